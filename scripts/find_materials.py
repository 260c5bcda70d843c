"""Rule find_materials: materials and objects of a field, and an exemplar of each material."""

from dav_gswt.field import read_field
from dav_gswt.logs import logging_to
from dav_gswt.materials import build, store, windows
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.views import scores

with logging_to(snakemake.log[0]):
    paths, seed = snakemake.input, snakemake.params.seed
    field, grid = read_field(paths.field), ground.read_ground(paths.ground)
    focused = windows.read_windows(paths.windows) if paths.get("windows") else None
    if paths.get("maps"):  # scored by a prior: tiles use its uncertainty instead of the field's own
        field = scores.apply_uncertainty(field, scores.read_pose_maps(paths.maps)[1])
        focused = windows.take_uncertainty(focused, field, grid) if focused else None
    masks = {name.removeprefix("mask_"): path for name, path in paths.items() if name.startswith("mask_")}
    found = build.find_materials(field, grid, seed, masks, focused)
    provenance = record_provenance({"field": paths.field, "ground": paths.ground}, {"seed": seed})
    store.write_materials(found, snakemake.output.materials, provenance)
