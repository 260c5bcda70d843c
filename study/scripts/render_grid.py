"""Rule render_grid: pictures of twenty by twenty tiles."""

from pathlib import Path

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt_study.seams import measure, pictures

with logging_to(snakemake.log[0]):
    params = snakemake.params
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    folder = Path(snakemake.output.pictures[0]).parent
    for surface in progress(list(measure.GROUNDS), "draw grids"):
        for shot, picture in pictures.render_terrain_pictures(bundle, surface, params.size).items():
            image_files.write_png(folder / f"{shot}_{surface}.png", picture)
