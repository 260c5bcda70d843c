"""Rule gather_curves: the cells' rounds, row by row, added to those of earlier runs."""

from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.comparison import curves

with logging_to(snakemake.log[0]):
    path = snakemake.output.curves
    new = [row for cell in snakemake.params.cells for row in curves.read_cell(cell)]
    csv_tables.write_table(path, curves.merge_rows(curves.read_curves(path), new))
