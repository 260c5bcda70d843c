"""Distances at which levels of detail change, and the least eye height: both follow from a splat's size in pixels.

The reference picture is 1920 pixels and 60 degrees wide, its focal length f = 960 / tan 30 degrees = 1663 pixels.
"""

import numpy as np

from dav_gswt.bundle.manifest import LevelEntry
from dav_gswt.errors import InputError

WIDTH, FOV = 1920, 60.0
FOCAL = 0.5 * WIDTH / np.tan(np.radians(FOV / 2))  # pixels
ASPECT = 9 / 16


def compute_levels(scales: list[float], pixels: float, band: float) -> list[LevelEntry]:
    """The manifest's levels from their mean scales, finest first.

    Level l gives way to l + 1 at the distance D_l = scale_{l+1} f / pixels, where the coarser one's mean standard
    deviation covers `pixels`; it fades over D_l -+ band D_l. The last level goes on without end (D null, band 0).
    Raises: InputError: the mean scale does not strictly rise.
    """
    for level, (fine, coarse) in enumerate(zip(scales, scales[1:], strict=False)):
        if not coarse > fine:
            raise InputError(
                f"level {level + 1}: mean scale {coarse:.6g} does not rise above level {level}'s {fine:.6g}; "
                "ask for fewer levels"
            )
    distances = [float(scale * FOCAL / pixels) for scale in scales[1:]]
    table = [
        LevelEntry(level, scale, far, band * far)
        for level, (scale, far) in enumerate(zip(scales, distances, strict=False))
    ]
    return [*table, LevelEntry(len(scales) - 1, scales[-1], None, 0.0)]


def compute_eye_floor(spacing: float, pixels: float, pitch: float = 30.0) -> float:
    """Lowest sensible eye height: the nearest visible ground then shows a finest disc `pixels` wide.

    Looking `pitch` degrees down, the picture's lower edge looks v further, tan v = 9/16 tan 30. A disc `spacing` wide
    covers f spacing / z pixels at the depth z, and the ground there lies at z = h cos v / sin(pitch + v).
    """
    v = np.arctan(ASPECT * np.tan(np.radians(FOV / 2)))
    depth = spacing * FOCAL / pixels
    return float(depth / np.cos(v) * np.sin(np.radians(pitch) + v))
