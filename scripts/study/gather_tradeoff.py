"""Rule gather_tradeoff: the cells of the trade-off as one table, and the front of those that test views tell apart."""

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.seams import tables as kept
from dav_gswt.study.tradeoff import tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    rows = tables.rows(snakemake.params.cells)
    figures.write_rows(out.table, rows)
    kept.write(out.pareto, tables.pareto(rows))
    kept.write(out.kept, kept.merged(kept.read(out.kept), rows, tables.KEY))
