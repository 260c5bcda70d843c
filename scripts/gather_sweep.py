"""Rule gather_sweep: the runs of a sweep as a table, a row for each."""

from dav_gswt import sweeps
from dav_gswt.files import write_table
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    write_table(snakemake.output.table, [sweeps.tabulate_cell(cell) for cell in snakemake.params.cells])
