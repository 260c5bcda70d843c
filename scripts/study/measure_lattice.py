"""Rule measure_lattice: the terrain from above, and how visibly it repeats."""

from dataclasses import asdict
from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.study import csv_tables
from dav_gswt.study.terrain import lattice
from dav_gswt.terrain import endless

with logging_to(snakemake.log[0]):
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent, snakemake.params.schema)
    terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"}, snakemake.params.classes)
    picture = lattice.render_from_above(terrain, lattice.choose_level(terrain))
    image_files.write_png(snakemake.output.picture, picture)
    row = {"materials": len(bundle.manifest.materials), "objects": len(bundle.manifest.objects or [])}
    csv_tables.write_table(snakemake.output.table, [row | asdict(lattice.measure_lattice(picture))])
