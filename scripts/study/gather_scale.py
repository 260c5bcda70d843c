"""Rule gather_scale: the curves of all cells, their exponents and a figure."""

from dav_gswt.files import read_json
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables, markdown
from dav_gswt.study.scale import growth

with logging_to(snakemake.log[0]):
    rows = growth.gather_rows([read_json(path) for path in snakemake.input.cells])
    csv_tables.write_table(snakemake.output.table, rows)
    markdown.write_page(snakemake.output.text, growth.describe_growth(rows))
    growth.plot_growth(rows, snakemake.output.plot)
