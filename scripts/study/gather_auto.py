"""Rule gather_auto: the choices of `auto`, as a table and as a page."""

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.tradeoff import auto, page, tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    csv_tables.write_table(out.table, auto.rows(snakemake.params.cells))
    csv_tables.update_table(out.kept, csv_tables.read_table(out.table), auto.KEY)
    page.write(out.page, auto.text(tables.read(out.table)))
