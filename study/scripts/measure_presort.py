"""Rule measure_presort: errors of pre-sorting, levels and rounding in pictures of the terrain."""

from pathlib import Path

from dav_gswt.bundle import store as bundles
from dav_gswt.logs import logging_to
from dav_gswt.terrain.fit_cover import gather_content
from dav_gswt.tiles import store
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import presort

with logging_to(snakemake.log[0]):
    paths = snakemake.input
    bundle = bundles.read_bundle(Path(paths.manifest).parent)
    tiles = store.read_material_tiles(paths.tiles, paths.seams, paths.levels)
    content = gather_content(tiles, paths.get("materials"), snakemake.params.seed)
    csv_tables.write_table(snakemake.output.table, presort.measure_approximations(content, bundle))
