"""Rule measure_shortcuts: what pre-sorting, levels and rounding do to the terrain's picture."""

from pathlib import Path

from dav_gswt.bundle import store as bundles
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.terrain import shortcuts
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given = snakemake.input
    bundle = bundles.read_bundle(Path(given.manifest).parent, snakemake.params.schema)
    csv_tables.write_table(snakemake.output.table, shortcuts.rows(store.read_tiles(given.tiles, given.seams), bundle))
