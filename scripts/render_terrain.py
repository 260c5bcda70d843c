"""Rule render_terrain: stills of the endless terrain."""

from pathlib import Path

from dav_gswt import images
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import assemble, still
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given, size = snakemake.input, snakemake.params.size
    bundle = read_json(given.manifest)
    terrain = assemble.of_tiles(store.read(given.tiles, given.seams), bundle)
    targets = {Path(path).stem: path for path in snakemake.output.stills}
    for shot in progress(still.SHOTS, "render stills"):
        camera = still.camera_of(shot, terrain.side, bundle["eye_floor"], size["width"], size["height"])
        picture = still.draw(terrain, camera, bundle["sky"], bundle["ground_colour"])
        images.write(targets[shot.name], picture)
