"""Rule write_tradeoff: the page of speed against accuracy."""

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt_study import markdown
from dav_gswt_study.tradeoff import page, tables

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    for source, target in zip(paths.figures, out.figures, strict=True):
        copy_file(source, target)
    rows, front = tables.read_tradeoff(paths.table), tables.read_tradeoff(paths.pareto)
    markdown.write_page(out.page, page.format_tradeoff(rows, front))
