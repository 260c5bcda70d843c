"""Rule run_extreme: what comes of the whole workflow at one of its extremes?"""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.study.stability import running
from dav_gswt.study.stability.extremes import EXTREMES

with logging_to(snakemake.log[0]):
    extreme = EXTREMES[snakemake.wildcards.extreme]
    root, lpips = Path(snakemake.params.root), snakemake.input.get("lpips")
    running.run(extreme, root, snakemake.output.folder, snakemake.threads, lpips)
