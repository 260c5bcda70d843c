"""Rule update_field: the field of the round before, refitted with this round's photos."""

import numpy as np

from dav_gswt.field import read_field, write_field
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_captured_views, read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground, regression_guard
from dav_gswt.reconstruction.fit_settings import UpdateSettings, select_settings
from dav_gswt.reconstruction.refinement import RefinementInput, refine_field

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    settings, captures = select_settings(UpdateSettings, params.preset), list(paths.captures)
    names, aside = (
        list(read_view_split(paths.views).start),
        regression_guard.list_rejected_photos(map(read_json, paths.fits)),
    )
    before = read_training_views(paths.images, paths.model, names, captures[:-1], settings.size)
    new = read_captured_views(captures[-1], settings.size)
    rng = np.random.default_rng([params.seed, params.t])
    last = read_field(paths.field), ground.read_ground(paths.ground), read_scene_frame(paths.frame)
    start = RefinementInput(*last, [v for v in before if v.name not in aside], new)
    updated = refine_field(start, settings, rng, params.keep)
    write_field(updated.field, snakemake.output.field)
    ground.write_ground(updated.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, updated.report.to_dict())
