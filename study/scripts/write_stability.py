"""Rule write_stability: the table of all runs, the page about numerical stability, and its figure."""

from pathlib import Path

from dav_gswt.files import read_json
from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study import csv_tables, markdown
from dav_gswt_study.stability import page, running

with logging_to(snakemake.log[0]):
    paths, out = snakemake.input, snakemake.output
    csv_tables.write_table(out.runs, running.tabulate_runs(Path(paths.runs[0]).parent))
    formulas, runs = csv_tables.read_table(paths.formulas), csv_tables.read_table(out.runs)
    figures.save_figure(page.plot_tolerances(formulas), out.plot)
    values = page.describe_stability(formulas, runs, read_json(paths.facts))
    markdown.write_page(out.page, paths.template, values)
