"""Rule split_views: which photos start, which may be asked for, which only test."""

import numpy as np

from dav_gswt.geometry.scene_frame import read_scene_frame
from dav_gswt.logs import logging_to
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.view_split import split_views, write_view_split

with logging_to(snakemake.log[0]):
    paths, params = snakemake.input, snakemake.params
    start = params.scene.get("start") or params.scene.get("photo_count")  # of a synthetic scene
    asked = start, params.scene.get("test"), params.scene.get("whole", False)
    model, frame = read_colmap_model(paths.model), read_scene_frame(paths.frame)
    split = split_views(model, frame, np.random.default_rng(params.seed), *asked)
    write_view_split(snakemake.output.views, split)
