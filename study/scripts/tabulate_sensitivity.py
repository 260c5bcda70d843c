"""Rule tabulate_sensitivity: one setting varied, the others fixed."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.tables import sensitivity, spread

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    sweeps = spread.read_sweeps(paths.sweeps, paths.get("viewer"))
    rows = sensitivity.tabulate_sensitivity(dict(zip(params.settings, sweeps, strict=True)), params.defaults)
    for path in (snakemake.output.table, snakemake.output.kept):
        csv_tables.write_table(path, rows)
