"""Rule report_photos: a page that says which photos were used, and what to photograph next."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.photos.report import write_report

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    write_report(Path(paths.frame).parent, paths.template, snakemake.wildcards.scene, snakemake.output.page)
