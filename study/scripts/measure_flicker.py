"""Rule measure_flicker: changes of the terrain's picture from frame to frame on a walk."""

from pathlib import Path

from dav_gswt import csv_tables
from dav_gswt.bundle import store
from dav_gswt.logs import logging_to
from dav_gswt.terrain import endless
from dav_gswt_study.terrain import flicker

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights)
    csv_tables.write_table(snakemake.output.table, flicker.measure_flicker(terrain, bundle.manifest, **params.walk))
