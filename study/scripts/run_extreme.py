"""Rule run_extreme: run the whole workflow at one extreme."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt_study.stability import running
from dav_gswt_study.stability.extremes import EXTREMES

with logging_to(snakemake.log[0]):
    extreme = EXTREMES[snakemake.wildcards.extreme]
    root, lpips = Path(snakemake.params.root), snakemake.params.lpips
    running.run_extreme(extreme, root, snakemake.output.folder, snakemake.threads, lpips)
