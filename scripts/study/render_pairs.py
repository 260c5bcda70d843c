"""Rule draw_pairs: a scene's crops for the perceptual study, two of a place."""

from dav_gswt.images import lpips_weights
from dav_gswt.lod import store as levels
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.study.forced_choice import pairs, store
from dav_gswt.study.seams import exemplar, ground
from dav_gswt.tiles import store as tiles

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    known = exemplar.Known.of(levels.read_levels(given.levels))
    laid = {}
    for name, *files in zip(params.tilings, given.tiles, given.seams, strict=True):
        cut = tiles.read_tiles(*files)
        laid[name] = ground.laid(cut, known.flattened(cut, params.tilings[name]), params.salt, params.tau)
    alexnet = lpips_weights.read(given.lpips) if given.get("lpips") else None
    inputs = {"seams": list(given.seams)} | ({"lpips": given.lpips} if alexnet else {})
    asked = dict(params.study)
    store.write(snakemake.output.pairs, pairs.drawn(laid, asked, alexnet), record_provenance(inputs, asked))
