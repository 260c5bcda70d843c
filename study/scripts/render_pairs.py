"""Rule render_pairs: pairs of crops of a scene for the forced-choice study."""

from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.tiles import store as tiles
from dav_gswt_study.forced_choice import kit, pairs
from dav_gswt_study.seams import placed_tiles

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    sets = {}
    for name, folder, seams in zip(params.tilings, paths.tiles, paths.seams, strict=True):
        cut = tiles.read_tiles(folder, seams, paths.levels)
        maps = placed_tiles.ExemplarMaps.from_levels(tiles.read_exemplars(seams, paths.levels)[0])
        sets[name] = placed_tiles.place_tiles(cut, maps.detrend(cut, params.tilings[name]), params.salt, params.tau)
    asked = dict(params.study)
    origin = record_provenance({"seams": list(paths.seams)}, asked)
    kit.write_pairs(snakemake.output.pairs, pairs.sample_pairs(sets, asked), origin)
