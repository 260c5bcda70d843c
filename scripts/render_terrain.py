"""Rule render_terrain: stills of the endless terrain."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import endless, light, stills

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    terrain = endless.terrain_from_bundle(bundle, params.heights, params.classes)
    manifest = light.apply_light(bundle.manifest, params.sun, 0.0, terrain.heights)
    targets = {Path(path).stem: path for path in snakemake.output.stills}
    for shot in progress(stills.list_shots(terrain, manifest.eye_floor), "render stills"):
        image_files.write_png(targets[shot.name], stills.render_shot(terrain, shot, manifest, *params.size))
