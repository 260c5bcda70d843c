"""Rule measure_repetition: autocorrelation of a large top view at the tiles' period."""

from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.tiles import store
from dav_gswt_study import csv_tables
from dav_gswt_study.seams import placed_tiles, repetition

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    maps = placed_tiles.ExemplarMaps.from_levels(levels.read_levels(paths.levels))
    tiles = store.read_tiles(paths.tiles, paths.seams)
    source = maps.detrend(tiles, params.tiling)
    fields = [level.field for level in source.levels]
    measured = repetition.measure_repetition(tiles, fields, source.exemplar.cells * tiles.spacing, params.seed)
    csv_tables.write_table(snakemake.output.table, repetition.tabulate_repetition(measured))
