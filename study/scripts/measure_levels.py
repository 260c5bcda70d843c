"""Rule measure_levels: errors of coarser levels against the finest."""

from dav_gswt.bundle import build
from dav_gswt.logs import logging_to
from dav_gswt.tiles import store
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain.level_fidelity import measure_levels

with logging_to(snakemake.log[0]):
    paths, used = snakemake.input, build.BundleOptions
    tiles = store.read_tiles(paths.tiles, paths.seams, paths.levels)
    csv_tables.write_table(snakemake.output.table, measure_levels(tiles, used.level_pixels, used.band))
