"""Rule tabulate_ablation: estimators, policies and tilings, each minus the baseline of its sweep."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.tables import ablation, spread

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    sweeps = spread.read_sweeps(paths.sweeps, paths.get("viewer"))
    rows = ablation.tabulate_ablation(dict(zip(params.baselines, sweeps, strict=True)), params.baselines)
    for path in (snakemake.output.table, snakemake.output.kept):
        csv_tables.write_table(path, rows)
