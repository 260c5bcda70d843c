"""Rule gather_auto: the choices of `auto`, as a table and as a page."""

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables, markdown
from dav_gswt.study.tradeoff import auto, tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    csv_tables.write_table(out.table, auto.tabulate_auto(snakemake.params.cells))
    csv_tables.update_table(out.kept, csv_tables.read_table(out.table), auto.KEY)
    markdown.write_page(out.page, auto.format_auto(tables.read_tradeoff(out.table)))
