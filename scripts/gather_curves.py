"""Rule gather_curves: the cells' rounds, row by row, added to those of earlier runs."""

from dav_gswt import figures
from dav_gswt.active.comparison import curves
from dav_gswt.logs import logging_to

with logging_to(snakemake.log[0]):
    path = snakemake.output.curves
    new = [row for cell in snakemake.params.cells for row in curves.rows(cell)]
    figures.write_rows(path, curves.merged(curves.read(path), new))
