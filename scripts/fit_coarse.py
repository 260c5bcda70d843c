"""Rule fit_coarse: the first field, from the start views alone."""

import numpy as np

from dav_gswt.field import write_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import coarse, ground
from dav_gswt.reconstruction.fitting.plan import FitSettings

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    settings, names = FitSettings.from_preset(params.preset), list(read_view_split(paths.views).start)
    photos = read_training_views(paths.images, paths.model, names, [], settings.fit_size, params.keep)
    frame, whole = read_scene_frame(paths.frame), params.scene.get("whole", False)
    start = coarse.read_start_views(frame, photos, paths.model, paths.images, whole)
    fitted = coarse.fit_coarse_field(start, settings, np.random.default_rng(params.seed))
    write_field(fitted.field, snakemake.output.field)
    ground.write_ground(fitted.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, vars(fitted.report))
