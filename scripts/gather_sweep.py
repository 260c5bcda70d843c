"""Rule gather_sweep: the runs of a sweep as a table, a row for each."""

from dav_gswt import csv_tables, sweeps
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    csv_tables.write_table(snakemake.output.table, [sweeps.tabulate_cell(cell) for cell in snakemake.params.cells])
