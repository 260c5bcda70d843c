"""Rule tabulate_timing: the time of each stage as a table."""

from dav_gswt import sweeps
from dav_gswt.files import write_table
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    write_table(snakemake.output.table, sweeps.tabulate_timing(snakemake.params.cells))
