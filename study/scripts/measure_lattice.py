"""Rule measure_lattice: the terrain from above, and how visibly it and each of its materials alone repeat."""

from dataclasses import asdict
from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to
from dav_gswt.terrain import endless
from dav_gswt_study import csv_tables
from dav_gswt_study.terrain import lattice

with logging_to(snakemake.log[0]):
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"}, snakemake.params.classes)
    level, names = lattice.choose_level(terrain), [material.name for material in bundle.manifest.materials]
    picture = lattice.render_from_above(terrain, level)
    image_files.write_png(snakemake.output.picture, picture)
    about = {"of": "all", "materials": len(names), "objects": len(bundle.manifest.objects or [])}
    rows = [about | asdict(lattice.measure_lattice(picture))]
    for number, name in enumerate(names if len(names) > 1 else []):
        alone = lattice.render_from_above(lattice.take_material(terrain, number), level)
        rows.append({"of": name, "materials": 1, "objects": 0} | asdict(lattice.measure_lattice(alone)))
    csv_tables.write_table(snakemake.output.table, rows)
