"""Rule bound_gain: policies, and the greedy choice by true gain, on the same pool of photos."""

from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.images import lpips_weights
from dav_gswt.logs import logging_to
from dav_gswt.photos.colmap_model import read_colmap_model, triangulate_points
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.study import csv_tables
from dav_gswt.study.views import gain_bound

with logging_to(snakemake.log[0]):
    paths, asked = snakemake.input, snakemake.params.bound
    weights = lpips_weights.read(paths.lpips) if paths.get("lpips") else None
    coarse = update = FitSettings.from_preset(asked)
    settings = gain_bound.BoundSettings(coarse, update, asked["k"], asked["rounds"], weights)
    split, model = read_view_split(paths.views), read_colmap_model(paths.model)
    start, photos, tests = (
        read_training_views(paths.images, paths.model, names, [], coarse.size)
        for names in (split.start, split.pool, split.test)
    )
    points, colours = triangulate_points(model, list(split.start), paths.images)
    margin = ground.WHOLE if snakemake.params.whole else ground.MARGIN
    frame = read_scene_frame(paths.frame)
    pool = gain_bound.Pool(frame, start, photos, tests, points, colours, margin)
    csv_tables.write_table(snakemake.output.table, gain_bound.compare_choices(pool, settings, asked["seeds"]))
