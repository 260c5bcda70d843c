"""Rule render_grid: 20 x 20 tiles from above and a walker's view, to look for grids, repetition and borders."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.bundle import store
from dav_gswt.images import image_files
from dav_gswt.logs import logging_to, progress
from dav_gswt.terrain import endless, stills
from dav_gswt_study.seams.measure import GROUNDS

TILES = 20  # a side of the picture from above
SQUARE = 1600  # pixels of its side

with logging_to(snakemake.log[0]):
    bundle = store.read_bundle(Path(snakemake.input.manifest).parent)
    folder, manifest = Path(snakemake.output.pictures[0]).parent, bundle.manifest
    for surface in progress(list(GROUNDS), "draw grids"):
        terrain = endless.terrain_from_bundle(bundle, GROUNDS[surface])
        # so high that a field of view of 60 degrees holds TILES tiles
        high = 0.5 * TILES * terrain.side / np.tan(np.radians(30.0)) / manifest.eye_floor
        above = stills.Shot("grid", (0.5, 0.5), float(high), 90.0, 90.0)
        far = replace(terrain, reach=2 * TILES + 8)  # all tiles are nearer than the far ground
        image_files.write_png(folder / f"grid_{surface}.png", stills.render_shot(far, above, manifest, SQUARE, SQUARE))
        walker = stills.render_shot(terrain, stills.SHOTS[0], manifest, *snakemake.params.size)
        image_files.write_png(folder / f"walker_{surface}.png", walker)
