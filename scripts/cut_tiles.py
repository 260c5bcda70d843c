"""Rule cut_tiles: sixteen tiles (times the variants), at every level, along the cuts made on the finest."""

import numpy as np

from dav_gswt import field, provenance
from dav_gswt.coarse import ground, maps
from dav_gswt.logs import logging_to
from dav_gswt.perceptual import weights
from dav_gswt.tiles import build, semantics, store
from dav_gswt.tiles.layout import Exemplar

with logging_to(snakemake.log[0]):
    given, seam = snakemake.input, snakemake.params.seam
    levels, grid = [field.read(path) for path in given.fields], ground.read(given.grounds[0])
    above = maps.over_exemplar(levels[0], grid)
    west, south, _ = grid.exemplar
    alexnet = weights.read(given.lpips) if given.get("lpips") else None
    options = build.Options.of(seam, semantics.Source(alexnet, seam.get("sam2")))
    exemplar = Exemplar(west, south, grid.spacing, grid.cells)
    rng = np.random.default_rng(snakemake.params.seed)
    tiles = build.cut_tiles(levels, exemplar, above.known_colour(), above.uncertainty, options, rng)
    inputs = {f"level{number}": path for number, path in enumerate(given.fields)}
    inputs |= {name: given[name] for name in ("lpips", "sam2") if given.get(name)}
    store.write(tiles, snakemake.output.tiles, snakemake.output.seams, provenance.of(inputs, dict(seam)))
