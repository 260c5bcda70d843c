"""Rule measure_scale: what one fit, render or scoring costs."""

import os
from pathlib import Path

from dav_gswt.field import read_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.provenance import describe_machine, record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.study.scale import costs

with logging_to(snakemake.log[0]):
    paths, params, what = snakemake.input, snakemake.params, snakemake.wildcards.what
    amount, field, frame = int(snakemake.wildcards.amount), read_field(paths.field), read_scene_frame(paths.frame)
    threads = {"threads": amount} if what == "threads" else {}
    if threads:
        os.environ["DAV_GSWT_THREADS"] = str(amount)
    if params.photos:
        settings = FitSettings.from_preset(params.preset | params.changed)
        found = costs.measure_fit(field, frame, paths.images[0], params.photos[0], settings, Path(params.keep))
    elif what in ("gaussians", "tiles"):
        found = (costs.measure_render if what == "gaussians" else costs.measure_view)(field, amount)
    else:
        found = costs.measure_scores(field, ground.read_ground(paths.ground), frame, amount)
    made = record_provenance({"field": paths.field}, params.preset) | describe_machine()
    write_json(snakemake.output.cost, {"kind": what} | found | threads | {"made": made})
