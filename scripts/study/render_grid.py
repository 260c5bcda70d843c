"""Rule render_grid: pictures of twenty by twenty tiles."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt.study.seams import pictures

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent, params.schema)
    for path in progress(snakemake.output.pictures, "draw grids"):
        shot, surface = Path(path).stem.split("_")
        image_files.write_png(path, pictures.render_terrain_picture(bundle, shot, surface, params.size))
