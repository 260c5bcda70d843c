"""Rule fit_coarse: the first field, from the start views alone."""

import numpy as np

from dav_gswt.field import write_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.colmap_model import read_colmap_model, triangulate_points
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, select_settings
from dav_gswt.reconstruction.fitting.trainer import FitOptions

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    settings = select_settings(CoarseSettings, params.preset)
    margin = ground.WHOLE if params.scene.get("whole", False) else ground.MARGIN
    names = list(read_view_split(paths.views).start)
    photos = read_training_views(paths.images, paths.model, names, [], settings.size, params.keep)
    points, colours = triangulate_points(read_colmap_model(paths.model), names, paths.images)
    rng = np.random.default_rng(params.seed)
    start = StartViews(read_scene_frame(paths.frame), photos, points, colours, margin)
    fitted = fit_coarse_field(start, settings, rng, FitOptions(snapshots=params.keep))
    write_field(fitted.field, snakemake.output.field)
    ground.write_ground(fitted.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, fitted.report.to_dict())
