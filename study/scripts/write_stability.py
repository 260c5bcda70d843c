"""Rule write_stability: the page about numerical stability, and its figure."""

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt_study.stability import page, plots

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    formulas, runs = csv_tables.read_table(paths.formulas), csv_tables.read_table(paths.runs)
    plots.write_tolerance_plot(snakemake.output.plot, formulas)
    page.write_stability_page(snakemake.output.page, paths.template, formulas, runs, read_json(paths.facts))
