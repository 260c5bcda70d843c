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
from dav_gswt.reconstruction.coarse import fit_coarse_field
from dav_gswt.reconstruction.fit_settings import FitSettings

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    quality, margin = FitSettings(**params.preset), ground.WHOLE if params.whole else ground.MARGIN
    names = list(read_view_split(given.views).start)
    photos = read_training_views(given.images, given.model, names, [], quality.size)
    points, colours = triangulate_points(read_colmap_model(given.model), names, given.images)
    rng = np.random.default_rng(params.seed)
    fitted = fit_coarse_field(read_scene_frame(given.frame), photos, points, colours, quality, rng, params.keep, margin)
    write_field(fitted.field, snakemake.output.field)
    ground.write_ground(fitted.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, fitted.report.to_dict())
