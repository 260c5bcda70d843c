"""Large pictures of the terrain, to look for grids, repetition and borders."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.bundle.store import Bundle
from dav_gswt.terrain import endless, stills
from dav_gswt_study.seams.measure import GROUNDS

TILES = 20  # a side of the picture from above
SQUARE = 1600  # pixels of its side


def render_terrain_pictures(bundle: Bundle, surface: str, size: dict) -> dict[str, Float32[Array, "h w 3"]]:
    """A `grid` of TILES x TILES tiles from above, and the view of a `walker`, on `flat` or `hilly` ground.

    size: of the walker's picture. From above, the eye is so high that a field of view of 60 degrees holds TILES tiles.
    """
    terrain, manifest = endless.terrain_from_bundle(bundle, GROUNDS[surface]), bundle.manifest
    high = 0.5 * TILES * terrain.side / np.tan(np.radians(30.0)) / manifest.eye_floor
    above = stills.Shot("grid", (0.5, 0.5), float(high), 90.0, 90.0)
    far = replace(terrain, reach=2 * TILES + 8)  # all tiles are nearer than the far ground
    return {
        "grid": stills.render_shot(far, above, manifest, SQUARE, SQUARE),
        "walker": stills.render_shot(terrain, stills.SHOTS[0], manifest, **size),
    }
