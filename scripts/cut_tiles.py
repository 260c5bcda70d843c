"""Rule cut_tiles: sixteen tiles (times the variants), at every level, along the cuts made on the finest."""

from pathlib import Path

from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import top_view
from dav_gswt.tiles import build, semantics, store
from dav_gswt.tiles.layout import Exemplar

with logging_to(snakemake.log[0]):
    given, tiling = snakemake.input, snakemake.params.tiling
    made = levels.read_levels(given.levels)
    fields, grid = made.fields, made.grids[0]
    above = top_view.render_exemplar(fields[0], grid)
    west, south, _ = grid.exemplar
    alexnet = lpips_weights.read(given.lpips) if given.get("lpips") else None
    options = build.TilingOptions.from_config(
        tiling, semantics.SemanticSource(alexnet, tiling.get("sam2")), made.wanted
    )
    exemplar = Exemplar(west, south, grid.spacing, grid.cells)
    rng = build.make_generator(snakemake.params.seed, tiling)
    tiles = build.cut_tiles(fields, exemplar, above.colour_or_nan(), above.uncertainty, options, rng)
    inputs = {f"level{number}": Path(given.levels, f"level{number}.ply") for number in range(len(fields))}
    inputs |= {name: given[name] for name in ("lpips", "sam2") if given.get(name)}
    store.write_tiles(tiles, snakemake.output.tiles, snakemake.output.seams, record_provenance(inputs, dict(tiling)))
