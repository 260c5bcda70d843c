"""Rule compare_timing: time of each stage, and of a frame of the viewer."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.tables import spread, timing

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    (cells,) = spread.read_sweeps([paths.sweep], paths.get("viewer"))
    rows = timing.tabulate_timing(timing.select_setting(cells, params.value), params.families)
    for path in (snakemake.output.table, snakemake.output.kept):
        csv_tables.write_table(path, rows)
