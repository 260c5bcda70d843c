"""Rule write_gallery: scenes, their verdicts and numbers, and a walk, on a page."""

from dav_gswt.logs import logging_to
from dav_gswt_study import gallery, markdown

with logging_to(snakemake.log[0]):
    params = snakemake.params
    rows = [gallery.tabulate_scene(cell) for cell in params.cells]
    values = gallery.describe_gallery(rows, params.walk, params.seconds)
    markdown.write_page(snakemake.output.page, snakemake.input.template, values)
