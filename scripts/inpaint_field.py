"""Rule inpaint_field: a prior inpaints the ground that no photo saw."""

from dav_gswt.field import read_field, write_field
from dav_gswt.files import copy_file, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.inpainting import build
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.provenance import record_provenance
from dav_gswt.reconstruction import ground
from dav_gswt.views import scoring

with logging_to(snakemake.log[0]):
    paths, out, params = snakemake.input, snakemake.output, snakemake.params
    fitted, grid, names = read_field(paths.field), ground.read_ground(paths.ground), read_view_split(paths.views).start
    photos = read_training_views(paths.images, paths.model, names, list(paths.captures), scoring.PHOTO_WIDTH)
    config = scoring.open_prior(params.prior, 0.0, params.seed)
    result = build.inpaint_field(fitted, grid, read_scene_frame(paths.frame), photos, config)
    if result.field is fitted:
        copy_file(paths.field, out.field)
    else:
        write_field(result.field, out.field)
    copy_file(paths.ground, out.ground)
    inputs = {name: paths[name] for name in ("field", "ground", "views", "weights")}
    about = {"prior": params.prior, "seed": params.seed}
    write_json(out.facts, result.describe(grid) | {"provenance": record_provenance(inputs, about)})
