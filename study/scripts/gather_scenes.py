"""Rule gather_scenes: the tables of several scenes in one."""

from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables

with logging_to(snakemake.log[0]):
    found = []
    for path, cell in zip(snakemake.input.tables, snakemake.params.cells, strict=True):
        found += [cell | row for row in csv_tables.read_table(path)]
    csv_tables.write_table(snakemake.output.table, found)
