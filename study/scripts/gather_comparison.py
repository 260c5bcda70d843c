"""Rule gather_comparison: the experiments of a sweep as one table, added to that of earlier runs."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.sweeps import tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    rows = [tables.tabulate_experiment(cell) for cell in snakemake.params.cells]
    csv_tables.write_table(out.table, rows)
    csv_tables.update_table(out.kept, rows, tables.KEY)
