"""Rule report_photos: a page that says how the photos fit together, and what is weak."""

from pathlib import Path

from dav_gswt.logs import logging_to
from dav_gswt.materials.segmentation import segment_ground
from dav_gswt.photos.report.page import write_report

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    scene, page = snakemake.wildcards.scene, snakemake.output.page
    write_report(Path(paths.frame).parent, paths.template, scene, page, lambda colour: segment_ground(colour)[0])
