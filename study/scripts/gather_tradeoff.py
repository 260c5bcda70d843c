"""Rule gather_tradeoff: all settings as one table, and the Pareto front of those measured by test views."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.tradeoff import tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    rows = tables.tabulate_settings(snakemake.params.cells)
    csv_tables.write_table(out.table, rows)
    csv_tables.write_table(out.pareto, tables.tabulate_front(rows))
    csv_tables.update_table(out.kept, rows, tables.KEY)
