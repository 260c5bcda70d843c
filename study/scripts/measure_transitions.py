"""Rule measure_transitions: whether borders of materials on a terrain look like photographed ones."""

from dataclasses import asdict
from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.bundle import store
from dav_gswt.field import read_field
from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.reconstruction import ground
from dav_gswt.terrain import endless
from dav_gswt_study.materials import accuracy, transitions

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    grid = ground.read_ground(paths.ground)
    seen = transitions.map_photographed(read_field(paths.field), grid, accuracy.read_found_labels(paths.materials))
    bundle = store.read_bundle(Path(paths.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"}, params.classes)
    row = transitions.TransitionMeasures()  # where one material was found
    if terrain.classes is not None:
        made = transitions.map_terrain(terrain, grid.spacing)
        row = transitions.measure_transitions(seen, made, lpips_weights.read(paths.lpips), params.seed)
    csv_tables.write_table(snakemake.output.table, [asdict(row)])
