"""Rule export_ground: the ground of a finite terrain for simulators and engines."""

from pathlib import Path

from dav_gswt.bundle.store import read_bundle
from dav_gswt.export import ground_files
from dav_gswt.logs import logging_to
from dav_gswt.terrain import endless
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    bundle = read_bundle(Path(paths.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    sets = store.read_material_tiles(paths.tiles, paths.seams, paths.levels)
    ground_files.export_ground(terrain, bundle.manifest, sets, params.export, snakemake.output.ground)
