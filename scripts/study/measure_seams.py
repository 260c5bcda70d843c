"""Rule measure_seams: Seam-LPIPS of crops on borders and cuts, with floors and ceilings."""

from pathlib import Path

from dav_gswt.files import write_json
from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import density, exemplar, measure
from dav_gswt.tiles import semantics, store

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    maps = exemplar.ExemplarMaps.from_levels(levels.read_levels(paths.levels))
    alexnet = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    tiles = store.read_tiles(paths.tiles, paths.seams)
    source = semantics.SemanticSource(alexnet, paths.get("sam2"))
    placed, straight = maps.place_with_straight(tiles, params.tiling, source, params.seed, params.tau)
    csv_tables.write_table(snakemake.output.crops, measure.measure_crops(placed, straight, alexnet, params.seed))
    inputs = {"seams": paths.seams, "level0": Path(paths.levels, "level0.ply")}
    inputs |= {"lpips": paths.lpips} if alexnet else {}
    dense = density.seam_density(tiles, placed.source)
    origin = record_provenance(inputs, dict(params.tiling))
    write_json(snakemake.output.facts, {"dense": dense, "provenance": origin})
