"""Rule measure_steadiness: does the terrain's picture jump while one walks?"""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.terrain import steadiness
from dav_gswt.terrain import endless

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent, params.schema)
    terrain = endless.terrain_from_bundle(bundle, params.heights)
    csv_tables.write_table(snakemake.output.table, steadiness.rows(terrain, bundle.manifest, **params.walk))
