"""Rule draw_walk: a walk over the endless terrain for the gallery, as one moving picture."""

from pathlib import Path

import numpy as np

from dav_gswt.bundle import store
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import endless, light
from dav_gswt_study import gallery
from dav_gswt_study.terrain import walk

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest[0]).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    terrain = gallery.suit_width(terrain, params.size["width"])
    manifest = light.apply_light(bundle.manifest, params.sun, 0.0, terrain.heights)
    shots, (first, last) = walk.walk_shots(**params.flight), params.hours
    moments = progress(list(zip(shots, np.linspace(first, last, len(shots)).tolist(), strict=True)), "render walk")
    frames = [gallery.render_moment(terrain, shot, manifest, hour, **params.size) for shot, hour in moments]
    gallery.animate_frames(frames, params.rate, snakemake.output.picture)
