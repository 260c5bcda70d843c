"""Rule update_field: the field of the round before, refitted with this round's photos."""

import numpy as np

from dav_gswt.field import read_field, write_field
from dav_gswt.files import read_json, write_json
from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.training_views import read_captured_views, read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import build, ground, regression_guard

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    quality, captures = build.FitSettings(**params.preset), list(given.captures)
    names, aside = read_view_split(given.views).start, regression_guard.set_aside(map(read_json, given.fits))
    before = read_training_views(given.images, given.model, names, captures[:-1], quality.size)
    new = read_captured_views(captures[-1], quality.size)
    rng = np.random.default_rng([params.seed, params.t])
    last = read_field(given.field), ground.read(given.ground), read_scene_frame(given.frame)
    made = build.refine(*last, [v for v in before if v.name not in aside], new, quality, rng, params.keep)
    write_field(made.field, snakemake.output.field)
    ground.write(made.grid, snakemake.output.ground)
    write_json(snakemake.output.fit, made.report)
