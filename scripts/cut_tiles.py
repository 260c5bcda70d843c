"""Rule cut_tiles: sixteen tiles (times the variants), at every level, along the cuts made on the finest."""

import numpy as np

from dav_gswt import field, provenance
from dav_gswt.coarse import ground, maps
from dav_gswt.logs import logging_to
from dav_gswt.tiles import build, store
from dav_gswt.tiles.layout import Exemplar

with logging_to(snakemake.log[0]):
    given, seam = snakemake.input, snakemake.params.seam
    levels, grid = [field.read(path) for path in given.fields], ground.read(given.grounds[0])
    above = maps.over_exemplar(levels[0], grid)
    west, south, _ = grid.exemplar
    options = build.Options(
        share=seam["tile"], strip=seam["strip"], variants=seam["variants"], candidates=seam["candidates"]
    )
    exemplar = Exemplar(west, south, grid.spacing, grid.cells)
    rng = np.random.default_rng(snakemake.params.seed)
    tiles = build.cut_tiles(levels, exemplar, above.colour, above.uncertainty, options, rng)
    inputs = {f"level{number}": path for number, path in enumerate(given.fields)}
    store.write(tiles, snakemake.output.tiles, snakemake.output.seams, provenance.of(inputs, dict(seam)))
