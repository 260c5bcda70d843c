"""Variation of the place: large-scale light and dark, which tiles lack since a trend is taken out of their exemplar.

It is gradient noise of the place, a colour a material, added to the colours of Gaussians in sRGB; `fit_variation` gives
it the exemplar's own statistics. All levels of a cell vary alike, and an object as the ground at its foot. Heights do
not vary. The viewer's `terrain/variation.js` and its shader compute the same; tests/golden/heights.json holds them
to it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import WaveEntry
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.terrain.choice import Floats
from dav_gswt.terrain.classes import TURN
from dav_gswt.terrain.heights import SHIFT, gradient_noise

VARIATION = 104  # axis of the hash: wave k uses VARIATION + k


@dataclass(frozen=True)
class Variation:
    """The variation of a terrain.

    Attributes:
        waves: of the manifest.
        side: of a tile.
        salt: of the terrain.
    """

    waves: Sequence[WaveEntry]
    side: float
    salt: int

    def at(self, x: Floats, y: Floats, material: int | Int[Array, "n"]) -> Float[Array, "n 3"]:
        """What is added to red, green and blue at points of the world."""
        change = np.zeros((len(x), 3))
        for k, wave in enumerate(self.waves):
            x, y = TURN[0] * x - TURN[1] * y, TURN[1] * x + TURN[0] * y
            noise = make_wave(x, y, k, wave.wavelength * self.side, self.salt)
            change += noise[:, None] * np.array(wave.colours)[material]
        return change


def make_wave(x: Float[Array, "*n"], y: Float[Array, "*n"], number: int, width: float, salt: int) -> Float[Array, "*n"]:
    """Noise in cells of a width, at points in the wave's own axes; |noise| <= 1, its standard deviation about 0.18."""
    noise, _ = gradient_noise(x / width + number * SHIFT[0], y / width + number * SHIFT[1], VARIATION + number, salt)
    return noise


def tint_field(field: GaussianField, change: Float[Array, "n 3"]) -> GaussianField:
    """The field with other colours, cut at 0 and 1."""
    sh = field.sh.copy()
    sh[:, 0] = rgb_to_sh(np.clip(field.base_colours + change, 0, 1).astype(np.float32))[:, 0]
    return replace(field, sh=sh)
