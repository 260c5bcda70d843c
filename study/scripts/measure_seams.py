"""Rule measure_seams: Seam-LPIPS of crops on borders and cuts of each material, with floors and ceilings."""

from pathlib import Path

from dav_gswt.files import write_json
from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.tiles import store
from dav_gswt_study import csv_tables
from dav_gswt_study.seams import measure

with logging_to(snakemake.log[0]):
    paths, params, tiling = snakemake.input, snakemake.params, dict(snakemake.params.tiling)
    alexnet = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    cut = store.read_material_tiles(paths.tiles, paths.seams, paths.levels)
    sets = zip(store.read_exemplars(paths.seams, paths.levels), cut, strict=True)
    rows, dense = measure.measure_materials(sets, tiling, alexnet, params.seed, params.tau)
    csv_tables.write_table(snakemake.output.crops, rows)
    inputs = {"seams": paths.seams, "level0": Path(paths.levels, "level0.ply")}
    inputs |= {"lpips": paths.lpips} if alexnet else {}
    write_json(snakemake.output.facts, {"dense": dense, "provenance": record_provenance(inputs, tiling)})
