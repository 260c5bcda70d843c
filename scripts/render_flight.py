"""Rule render_flight: a walk over the endless terrain, frame by frame."""

from dav_gswt import images
from dav_gswt.files import read_json, whole_folder
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import assemble, still
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    given, params = snakemake.input, snakemake.params
    bundle = read_json(given.manifest)
    terrain = assemble.of_tiles(store.read(given.tiles, given.seams), bundle, params.heights)
    with whole_folder(snakemake.output.frames) as folder:
        for shot in progress(still.flight(**params.flight), "render flight"):
            images.write(folder / f"{shot.name}.png", still.taken(terrain, shot, bundle, **params.size))
