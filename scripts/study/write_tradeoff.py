"""Rule write_tradeoff: the page of speed against accuracy."""

from dav_gswt.files import copy_file
from dav_gswt.logs import logging_to
from dav_gswt.study.tradeoff import page, tables

with logging_to(snakemake.log[0]):
    given, out = snakemake.input, snakemake.output
    for source, target in zip(given.figures, out.figures, strict=True):
        copy_file(source, target)
    page.write(out.page, page.text(tables.read(given.table), tables.read(given.pareto)))
