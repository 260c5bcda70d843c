"""Rule tabulate_timing: the time of each stage as a table."""

from dav_gswt import csv_tables, sweeps
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    csv_tables.write_table(snakemake.output.table, sweeps.tabulate_timing(snakemake.params.cells))
