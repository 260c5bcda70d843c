"""Rule gather_scale: the curves of all cells, their exponents and a figure."""

from dav_gswt import csv_tables
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt_study import markdown
from dav_gswt_study.scale import growth, page

with logging_to(snakemake.log[0]):
    cells = [read_json(path) for path in snakemake.input.cells]
    rows = growth.gather_rows(cells)
    csv_tables.write_table(snakemake.output.table, rows)
    growth.plot_growth(rows, snakemake.output.plot)
    values = page.describe(rows, cells, snakemake.params.asked, snakemake.params.preset)
    markdown.write_page(snakemake.output.page, markdown.render_template(snakemake.input.template, values))
