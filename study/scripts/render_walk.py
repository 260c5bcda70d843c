"""Rule render_walk: a walk over the endless terrain for the gallery, frame by frame."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.files import atomic_folder
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import endless, stills
from dav_gswt_study import gallery
from dav_gswt_study.terrain import flicker

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    terrain = gallery.suit_width(terrain, params.size["width"])
    with atomic_folder(snakemake.output.frames) as folder:
        for shot in progress(flicker.walk_shots(**params.flight), "render walk"):
            image_files.write_png(
                folder / f"{shot.name}.png", stills.render_shot(terrain, shot, bundle.manifest, **params.size)
            )
