"""Rule draw_walk: a walk over the endless terrain for the gallery, as one moving picture."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import endless, stills
from dav_gswt_study import gallery
from dav_gswt_study.terrain import walk

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest[0]).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    terrain = gallery.suit_width(terrain, params.size["width"])
    shots = progress(walk.walk_shots(**params.flight), "render walk")
    frames = [stills.render_shot(terrain, shot, bundle.manifest, **params.size) for shot in shots]
    gallery.animate_frames(frames, params.rate, snakemake.output.picture)
