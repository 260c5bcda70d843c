"""Rule gather_curves: the cells' rounds, row by row."""

from dav_gswt import csv_tables
from dav_gswt.logs import logging_to
from dav_gswt_study.comparison import curves

with logging_to(snakemake.log[0]):
    rows = [row for cell in snakemake.params.cells for row in curves.read_cell(cell)]
    csv_tables.write_table(snakemake.output.curves, rows)
