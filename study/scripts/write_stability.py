"""Rule write_stability: the page about numerical stability, and its figure."""

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt.images import figures
from dav_gswt.logs import logging_to
from dav_gswt_study import markdown
from dav_gswt_study.stability import page

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    formulas, runs = csv_tables.read_table(paths.formulas), csv_tables.read_table(paths.runs)
    figures.save_figure(page.plot_tolerances(formulas), snakemake.output.plot)
    values = page.describe_stability(formulas, runs, read_json(paths.facts))
    markdown.write_page(snakemake.output.page, markdown.render_template(paths.template, values))
