"""Rule gather_extremes: the outcomes of all runs, in one table."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.stability import running

with logging_to(snakemake.log[0]):
    rows = running.tabulate_runs(Path(snakemake.input.runs[0]).parent)
    for path in snakemake.output:
        csv_tables.write_table(path, rows)
