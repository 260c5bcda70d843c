"""Rule measure_orders: errors of pre-sorted orders of neighbouring directions in pictures of tiles."""

from dav_gswt import csv_tables
from dav_gswt.bundle import build
from dav_gswt.logs import logging_to
from dav_gswt.tiles import store
from dav_gswt_study.terrain.order_fidelity import measure_orders

with logging_to(snakemake.log[0]):
    tiles = store.read_tiles(snakemake.input.tiles, snakemake.input.seams)
    csv_tables.write_table(snakemake.output.table, measure_orders(tiles, build.BundleOptions.decibels))
