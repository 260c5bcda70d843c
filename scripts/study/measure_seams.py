"""Rule measure_seams: Seam-LPIPS of crops on borders and cuts, with floors and ceilings."""

from pathlib import Path

from dav_gswt.files import write_json
from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.study import csv_tables
from dav_gswt.study.seams import density, exemplar, measure, placed_tiles
from dav_gswt.tiles import build, semantics, store

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    maps = exemplar.ExemplarMaps.from_levels(levels.read_levels(given.levels))
    alexnet = lpips_weights.read(given.lpips) if given.get("lpips") else None
    tiles = store.read_tiles(given.tiles, given.seams)
    rng = build.make_generator(params.seed, params.tiling)
    source = semantics.SemanticSource(alexnet, given.get("sam2"))
    sets = tiles, maps.cut_straight(params.tiling, source, rng)
    patches = maps.detrend(tiles, params.tiling)
    placed = [placed_tiles.place_tiles(cut, patches, params.seed, params.tau) for cut in sets]
    csv_tables.write_table(snakemake.output.crops, measure.measure_crops(*placed, alexnet, params.seed))
    inputs = {"seams": given.seams, "level0": Path(given.levels, "level0.ply")} | (
        {"lpips": given.lpips} if alexnet else {}
    )
    found = {
        "dense": density.seam_density(tiles, patches),
        "provenance": record_provenance(inputs, dict(params.tiling)),
    }
    write_json(snakemake.output.facts, found)
