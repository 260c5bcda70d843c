"""Rule fit_chosen_photos: one fit to the photos that another preset's rounds chose."""

import numpy as np

from dav_gswt.field import write_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground, update

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    names, size = list(read_view_split(paths.views).start), params.preset["fit_size"]
    photos = read_training_views(paths.images, paths.model, names, list(paths.captures), size, params.keep)
    files = update.PhotoFiles(paths.model, paths.images, len(names), params.scene.get("whole", False))
    frame, rng = read_scene_frame(paths.frame), np.random.default_rng([params.seed, params.t])
    fitted = update.fit_chosen_photos(photos, frame, params.preset, files, rng)
    write_field(fitted.field, snakemake.output.field)
    ground.write_ground(fitted.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, vars(fitted.report))
