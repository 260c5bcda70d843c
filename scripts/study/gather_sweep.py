"""Rule gather_sweep: the cells of a sweep as one table, added to what earlier runs measured."""

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.seams import tables as kept
from dav_gswt.study.sweeps import tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    rows = [tables.row(cell) for cell in snakemake.params.cells]
    figures.write_rows(out.table, rows)
    kept.write(out.kept, kept.merged(kept.read(out.kept), rows, tables.KEY))
