"""Rule render_terrain: stills of the endless terrain."""

from pathlib import Path

from dav_gswt import images
from dav_gswt.files import read_json
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import assemble, still
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    bundle = read_json(given.manifest)
    terrain = assemble.of_tiles(store.read(given.tiles, given.seams), bundle, params.heights)
    targets = {Path(path).stem: path for path in snakemake.output.stills}
    for shot in progress(still.SHOTS, "render stills"):
        images.write(targets[shot.name], still.taken(terrain, shot, bundle, **params.size))
