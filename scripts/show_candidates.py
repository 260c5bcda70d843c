"""Rule show_candidates: what do some candidates truly show?"""

from pathlib import Path

from dav_gswt.active import candidates
from dav_gswt.active.calibration import truth
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    scene, out = snakemake.params.scene, Path(snakemake.output.truth)
    pool = candidates.hemisphere(scene, read_json(snakemake.input.frame))
    out.mkdir(parents=True)
    truth.write(out, truth.shown(scene, truth.spread(pool, snakemake.params.poses), ""))
