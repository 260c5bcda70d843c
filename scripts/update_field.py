"""Rule update_field: the field of the round before, updated with this round's photos."""

import numpy as np

from dav_gswt.field import read_field, write_field
from dav_gswt.files import write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground, update

with logging_to(snakemake.log[0]):
    paths, params, size = snakemake.input, snakemake.params, snakemake.params.preset["fit_size"]
    captures, names = list(paths.captures), list(read_view_split(paths.views).start)
    views = read_training_views(paths.images, paths.model, names, captures, size, params.keep)
    count = len(views) - len(read_capture_record(captures[-1]))
    rng = np.random.default_rng([params.seed, params.t])
    last = read_field(paths.field), ground.read_ground(paths.ground), read_scene_frame(paths.frame)
    files = update.PhotoFiles(paths.model, paths.images, len(names), params.scene.get("whole", False))
    given = update.UpdateInput(*last, views[:count], views[count:])
    updated = update.update_as_preset(given, params.preset, files, rng)
    write_field(updated.field, snakemake.output.field)
    ground.write_ground(updated.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, vars(updated.report))
