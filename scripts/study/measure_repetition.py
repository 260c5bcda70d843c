"""Rule measure_repetition: does a large top view repeat at the tiles' period?"""

from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import exemplar, plots, repetition
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given, out, params = snakemake.input, snakemake.output, snakemake.params
    known = exemplar.Known.of(levels.read_levels(given.levels))
    tiles = store.read_tiles(given.tiles, given.seams)
    source = known.flattened(tiles, params.tiling)
    fields = [shelf.field for shelf in source.levels]
    found = repetition.repeats(tiles, fields, source.exemplar.cells * tiles.spacing, params.seed)
    csv_tables.write_table(out.table, repetition.rows(found))
    plots.write_repeats(out.plot, found)
