"""Rule make_levels: ever coarser levels of the field."""

from dav_gswt.field import read_field
from dav_gswt.lod import build, merge, store
from dav_gswt.logs import logging_to
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.views import pose_maps

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    finest, grid = read_field(given.field), ground.read_ground(given.ground)
    if given.get("maps"):  # a prior was asked: what it doubts is what the tiles go by
        finest = pose_maps.apply_uncertainty(finest, pose_maps.read_pose_maps(given.maps)[1])
    steps = params.preset["level_steps"]
    levels = build.build_levels(*merge.crop_to_blocks(finest, grid, 1), params.levels, steps, params.seed, params.keep)
    inputs = {"field": given.field, "ground": given.ground}
    asked = {"levels": params.levels, "level_steps": steps, "seed": params.seed}
    store.write_levels(levels, snakemake.output.levels, record_provenance(inputs, asked))
