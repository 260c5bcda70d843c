"""Rule make_levels: ever coarser levels of the field, or of each material's exemplar."""

from dav_gswt.field import read_field
from dav_gswt.lod import build, merge, store
from dav_gswt.logs import logging_to
from dav_gswt.materials.store import read_exemplars
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.views import scores

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    inputs = {"field": paths.field, "ground": paths.ground}
    if paths.get("materials"):
        exemplars, inputs = read_exemplars(paths.materials), {"materials": paths.materials}
    else:
        exemplars = [(read_field(paths.field), ground.read_ground(paths.ground))]
        if paths.get("maps"):  # scored by a prior: tiles use its uncertainty instead of the field's own
            maps = scores.read_pose_maps(paths.maps)[1]
            exemplars = [(scores.apply_uncertainty(field, maps), grid) for field, grid in exemplars]
    steps = params.preset["level_steps"]
    cropped = [merge.crop_to_blocks(*exemplar, 1) for exemplar in exemplars]
    sets = [build.build_levels(*each, params.levels, steps, params.seed) for each in cropped]
    asked = {"levels": params.levels, "level_steps": steps, "seed": params.seed}
    store.write_levels(sets, snakemake.output.levels, record_provenance(inputs, asked))
