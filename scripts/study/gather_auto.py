"""Rule gather_auto: what `auto` chose, as a table and as a page."""

from dav_gswt.logs import logging_to
from dav_gswt.study import figures
from dav_gswt.study.seams import tables as kept
from dav_gswt.study.tradeoff import auto, page, tables

with logging_to(snakemake.log[0]):
    out = snakemake.output
    figures.write_rows(out.table, auto.rows(snakemake.params.cells))
    kept.write(out.kept, kept.merged(kept.read(out.kept), kept.read(out.table), auto.KEY))
    page.write(out.page, auto.text(tables.read(out.table)))
