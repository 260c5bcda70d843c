"""Rule render_grid: pictures of twenty by twenty tiles."""

from pathlib import Path

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.files import read_json
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt.study.seams import pictures
from dav_gswt.tiles import store

with logging_to(snakemake.log[0]):
    paths, bundle = snakemake.input, Manifest.from_dict(read_json(snakemake.input.manifest))
    tiles = store.read_tiles(paths.tiles, paths.seams)
    for path in progress(snakemake.output.pictures, "draw grids"):
        shot, surface = Path(path).stem.split("_")
        image_files.write_png(
            path, pictures.render_terrain_picture(tiles, bundle, shot, surface, snakemake.params.size)
        )
