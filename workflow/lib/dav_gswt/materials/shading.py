"""Brightness that relief and sun explain: classes of ground are told apart by what is left.

Ground in hard light has two colours, the one in the sun and the one in the shade. Its light is modelled as that of
Lambertian ground below one sun and an even sky, albedo (ambient + direct max(0, n l)) in linear light, with normals n
of the heights (Horn 1970). What is wider than relief is albedo: all is compared with its surroundings, so that dark
ground which lies lower than bright ground tells no sun. Shadow cast over the relief is not modelled: a ray over the
heights explained half a per cent more.
"""

import logging
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.images.srgb import decode_srgb, encode_srgb
from dav_gswt.materials.maps import GroundMaps, find_wide_parts

_log = logging.getLogger(__name__)

RELIEF, AROUND = 1 / 128, 1 / 4  # of the side: blurs of heights and light, and of the surroundings
FITTED = 64  # cells along a side, at most, that the sun is fitted on
AZIMUTHS, HEIGHTS = range(0, 360, 10), range(10, 71, 5)  # degrees, of the suns that are tried
SHARES = np.linspace(0.05, 0.95, 10)  # of the light of level ground, that are tried for what is no sun's
LEAST_EXPLAINED = 0.4  # of the variance of brightness: with less (desert .26), shadows of plants became objects
LEAST_TOLD = 0.1  # the same share, from which the position of the sun is believed
SHADE = 0.5  # of the light of level ground: less is shade that no tile can show, where it is wide
WIDE = 1 / 30  # of the side: narrower shade is texture, as that of ripples
LUMINANCE = (0.2126, 0.7152, 0.0722)


@dataclass(frozen=True)
class Sun:
    """The light on some ground, over that on level ground.

    Attributes:
        direction: unit vector towards the sun: east, north, up. Relief without deep shade tells its azimuth well and
            its height hardly.
        ambient: linear RGB where no sun is.
        explained: share of the variance of brightness, over that of the surroundings, that it explains.
    """

    direction: Float[Array, "3"]
    ambient: Float[Array, "3"]
    explained: float

    @property
    def direct(self) -> Float[Array, "3"]:
        """What the sun adds where it stands straight above the surface."""
        return (1 - self.ambient) / self.direction[2]

    @property
    def elevation(self) -> float:
        """Degrees above the horizon."""
        return float(np.degrees(np.arcsin(np.clip(self.direction[2], -1, 1))))

    @property
    def azimuth(self) -> float:
        """Degrees clockwise from the world's +y."""
        return float(np.degrees(np.arctan2(self.direction[0], self.direction[1])) % 360)

    def shade(self, normals: Float[Array, "*shape 3"]) -> Float[Array, "*shape 3"]:
        """Light of ground with these normals."""
        return self.ambient + np.maximum(0, normals @ self.direction)[..., None] * self.direct


def even_light(maps: GroundMaps, sun: Sun) -> GroundMaps:
    """The maps without shading: each cell's light is divided by that of its relief. No wide and deep shade is known."""
    shading, light = sun.shade(measure_normals(maps)), decode_srgb(maps.colour)
    even = light / shading
    usual = gaussian_filter(even @ LUMINANCE, AROUND * maps.cells)
    dark = gaussian_filter(light @ LUMINANCE, RELIEF * maps.cells) < SHADE * usual
    shade = find_wide_parts(dark & (shading @ LUMINANCE < SHADE), WIDE * maps.cells)
    return replace(maps, colour=encode_srgb(even), known=maps.known & ~shade)


def fit_sun(maps: GroundMaps) -> Sun | None:
    """The sun that explains most of the brightness, of many tried; None where none explains LEAST_TOLD."""
    block = -(-maps.cells // FITTED)
    light = gaussian_filter(decode_srgb(maps.colour), (RELIEF * maps.cells, RELIEF * maps.cells, 0))
    normals, light = _average(measure_normals(maps), block), _average(light, block)
    seen = [_compare_around(layer) for layer in (light @ LUMINANCE, *np.moveaxis(light, -1, 0))]

    def explain(direction: Float[Array, "3"], share: float, values: Float[Array, "k k"]) -> float:
        shading = share + (1 - share) / direction[2] * np.maximum(0, normals @ direction)
        return 1 - float((values - _compare_around(shading)).var() / max(float(values.var()), 1e-12))

    best = max(product(list_directions(), SHARES), key=lambda each: explain(*each, seen[0]))
    explained = explain(*best, seen[0])
    if explained < LEAST_TOLD:
        return None
    _log.info("light: relief in the sun explains %.0f %% of the ground's brightness", 100 * explained)
    ambient = [max(SHARES, key=lambda share: explain(best[0], share, values)) for values in seen[1:]]
    return Sun(best[0], np.array(ambient), explained)


def list_directions() -> Float[Array, "n 3"]:
    """Unit vectors towards the suns that are tried."""
    azimuth, height = np.radians(list(product(AZIMUTHS, HEIGHTS))).T
    return np.stack([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)], 1)


def measure_normals(maps: GroundMaps) -> Float[Array, "m m 3"]:
    """Unit normals of the relief: east, north, up."""
    north, east = np.gradient(gaussian_filter(maps.height, RELIEF * maps.cells) / maps.exemplar.spacing)
    normals = np.stack([-east, -north, np.ones_like(east)], -1)
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def _compare_around(light: Float[Array, "k k"]) -> Float[Array, "k k"]:
    """Logarithm of light less that of its surroundings."""
    log = np.log(np.maximum(light, 1e-4))
    return log - gaussian_filter(log, AROUND * len(log), mode="nearest", truncate=2)


def _average(layers: Float[Array, "m m c"], block: int) -> Float[Array, "k k c"]:
    """Means of blocks of cells."""
    k = len(layers) // block
    return layers[: k * block, : k * block].reshape(k, block, k, block, -1).mean((1, 3))
