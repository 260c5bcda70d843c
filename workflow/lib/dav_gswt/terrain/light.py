"""Light of the place: hills in the sun, their shadows, and the colours of the sky, as the sun moves over the day.

The colours of Gaussians contain the light of level ground below the captured sun. Ground that slopes, or lies below
another sun, is multiplied by the ratio of its own light to that light, in linear light. What is smaller than the
surface stays as it was photographed: ripples, and the shading of objects, which are lit like the ground below them.

Elevations are in degrees above the horizon, azimuths in degrees clockwise from the terrain's +y. `north` is the azimuth
of +y itself, clockwise from true north. The viewer's `terrain/light.js` and its shader compute the
same; tests/golden/light.json holds all to it.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates

from dav_gswt.bundle.land_cover import ASSUMED_SUN, LightEntry
from dav_gswt.bundle.manifest import Manifest, Sky
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry.sun import LOWEST  # below, the light no longer changes, and the day leaves such hours out
from dav_gswt.terrain.choice import Floats, Vector
from dav_gswt.terrain.heights import FlatSurface, HeightField, Sphere

RAYLEIGH = np.array([0.0496, 0.0987, 0.2267])  # optical depths of air at 0.65, 0.55 and 0.45 micrometres
AEROSOL = np.array([0.0805, 0.1, 0.1298])  # optical depths of clear, dry haze
FORWARD = 0.756  # share of the light scattered by haze that reaches the ground
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
SUNRISE, SUNSET = 6.0, 18.0  # hours
GAMMA = 2.2  # exponent that stands for the curve of sRGB
MOST = 4.0  # times the captured light, of any ground
SIZE, CELL = 256, 0.375  # points along a side of the horizon's grid, and their distance in tile sides
SNAP = 32  # points by which the grid moves with the eye
STEPS, FARTHEST = 40, 64.0  # samples towards the sun, from 1 to this many cells away
BORDER = 16  # points along the edge of the grid over which shadows end
MOST_MARGIN = 2.0
SOFT = 0.02  # half the width of a shadow's edge, as a change of the sun's elevation in radians
STEEPEST = 80.0  # elevation, of which the tangent is taken: above, MOST_MARGIN would be no whole sun
EXPOSED = 0.7  # share of a change of brightness, in stops, that the exposure makes up for
GLOW, GLOW_WIDTH = 0.35, 6  # brightness of the sky about a sun at the horizon, and the exponent of its cosine
HAZE = 0.1  # share of the sun's beam in the light of the horizon


@dataclass(frozen=True)
class Sun:
    """A position of the sun. elevation: 0 to 90. azimuth: 0 to 360."""

    elevation: float
    azimuth: float

    @property
    def direction(self) -> Float[Array, "3"]:
        """Unit vector towards the sun."""
        e, a = np.radians(self.elevation), np.radians(self.azimuth)
        return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def measure_light(elevation: float) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Irradiance across the sun's beam, and irradiance of level ground by the sky, over that outside the atmosphere.

    A clear sky after Bird and Hulstrom (1981), with the air mass of Kasten and Young (1989).
    """
    elevation = max(elevation, LOWEST)
    rise = np.sin(np.radians(elevation))
    mass = 1 / (rise + 0.50572 * (elevation + 6.07995) ** -1.6364)
    air, haze = np.exp(-mass * RAYLEIGH), np.exp(-mass * AEROSOL)
    return air * haze, rise * (0.5 * (1 - air) + FORWARD * (1 - haze))


def level_light(elevation: float) -> Float[Array, "3"]:
    """Irradiance of level ground by sun and sky."""
    direct, sky = measure_light(elevation)
    return direct * np.sin(np.radians(max(elevation, LOWEST))) + sky


def find_hour(captured: Sun, north: float = 0.0) -> float:
    """Solar time of the captured sun on the path of `sun_at`."""
    x, y, z = Sun(captured.elevation, captured.azimuth + north).direction
    return float(SUNRISE + np.arctan2(np.hypot(y, z), x) / np.pi * (SUNSET - SUNRISE))


def sun_at(captured: Sun, hour: float, north: float = 0.0) -> Sun:
    """The sun at a solar time, on the path through the captured sun that begins due east and ends due west.

    It is the path of an equinox at the latitude where the captured sun lies on it. Hours at which the sun would be
    lower than LOWEST give the nearest one at which it is not.
    """
    _, y, z = Sun(captured.elevation, captured.azimuth + north).direction
    noon = np.array([0.0, y, z]) / np.hypot(y, z)
    rise = min(np.sin(np.radians(LOWEST)) / noon[2], 1.0)
    first = np.arcsin(rise)
    angle = np.clip((hour - SUNRISE) / (SUNSET - SUNRISE) * np.pi, first, np.pi - first)
    x, y, z = np.cos(angle) * np.array([1.0, 0.0, 0.0]) + np.sin(angle) * noon
    azimuth = (np.degrees(np.arctan2(x, y)) - north) % 360.0
    return Sun(float(np.degrees(np.arctan2(z, np.hypot(x, y)))), float(azimuth))


def apply_light(manifest: Manifest, sun: Any, wind: float, surface: HeightField) -> Manifest:
    """The manifest of a page: the bundle's with the captured sun and the wind of the config.

    sun: the config's `sun`, whose azimuth is from north. A planet has neither: its colours stay as captured.
    """
    if isinstance(surface, Sphere):
        return replace(manifest, light=None, wind=None)
    light = manifest.light or LightEntry(*ASSUMED_SUN, "assumed")
    if sun == "none":
        light = None
    elif sun != "auto":
        light = LightEntry(sun["elevation"], (sun["azimuth"] - light.north) % 360, "config", light.north)
    return replace(manifest, light=light, wind=wind or None)


def light_of(manifest: Manifest, hour: float | None = None) -> "Light | None":
    """The light of a page at a solar time, by default of the captured sun; None if the page has no sun.

    Raises: ValueError: an hour that is not finite, or without a sun.
    """
    if hour is not None and not (np.isfinite(hour) and manifest.light):
        raise ValueError(f"hour: {hour} is not a finite number" if manifest.light else "hour: this terrain has no sun")
    if manifest.light is None:
        return None
    captured = Sun(manifest.light.elevation, manifest.light.azimuth)
    return Light(captured, captured if hour is None else sun_at(captured, hour, manifest.light.north))


@dataclass(frozen=True)
class Light:
    """The light of a sun, for ground whose colours contain the light of the captured sun."""

    captured: Sun
    sun: Sun

    @property
    def exposure(self) -> float:
        """Factor of all light, as a camera changes it with the brightness of level ground."""
        before, after = (level_light(each.elevation) @ LUMINANCE for each in (self.captured, self.sun))
        return float((before / after) ** EXPOSED)

    @cached_property
    def terms(self) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Sunlight on ground that faces the sun, and skylight on level ground, over captured light of level ground."""
        direct, sky = measure_light(self.sun.elevation)
        scale = self.exposure / level_light(self.captured.elevation)
        return direct * scale, sky * scale

    def ratio(self, slope: Float[Array, "*n 2"], visible: Float[Array, "*n"] | float = 1.0) -> Float[Array, "*n 3"]:
        """Light of ground relative to the captured light of level ground. visible: share of the sun's disc."""
        direct, ambient = self.terms
        east, north, up = self.sun.direction
        n = 1 / np.sqrt(1 + (slope**2).sum(-1))
        lambert = np.maximum((up - slope @ np.array([east, north])) * n, 0) * visible
        return np.minimum(lambert[..., None] * direct + (0.5 + 0.5 * n)[..., None] * ambient, MOST)

    @property
    def ground_ratio(self) -> Float[Array, "3"]:
        """Ratio of open, level ground."""
        return self.ratio(np.zeros(2))

    def change_sky(self, sky: Sky) -> Sky:
        """The sky with this sun. The exposure does not make it brighter than it was captured."""
        beams, skies = zip(*(measure_light(each.elevation) for each in (self.captured, self.sun)), strict=True)
        above = self.exposure * skies[1] / skies[0]
        level = self.exposure * (skies[1] + HAZE * beams[1]) / (skies[0] + HAZE * beams[0])
        pairs = (sky.zenith, above), (sky.horizon, level)
        zenith, horizon = (relight(np.array(colour), each / max(each @ LUMINANCE, 1.0)) for colour, each in pairs)
        return Sky(zenith.tolist(), horizon.tolist())

    @property
    def sun_colour(self) -> Float[Array, "3"]:
        """sRGB colour of the sun's disc."""
        direct, _ = measure_light(self.sun.elevation)
        return (direct / direct.max()) ** (1 / GAMMA)

    def add_sun(self, colours: Float[Array, "*n 3"], rays: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
        """Colours of the sky along unit vectors, with the sun and the glow about it."""
        close = np.maximum(rays @ self.sun.direction, 0)[..., None]
        glow = GLOW * (1 - self.sun.direction[2]) ** 4 * close**GLOW_WIDTH
        edge = np.clip((close - 0.99988) / 0.00008, 0, 1)
        disc = np.clip(edge * edge * (3 - 2 * edge) + 0.25 * close**350, 0, 1)
        colours = colours + glow * (self.sun_colour - colours)
        return colours + disc * (self.sun_colour - colours)


@dataclass(frozen=True)
class PlacedLight:
    """The light over the surface around an eye, with the shadows that the surface casts on itself.

    Attributes:
        margin: at points of the grid, by how much the sun is higher than the horizon; tangents. None: no shadows.
        first: world position of the grid's south-western point.
        cell: distance of its points.
    """

    light: Light
    surface: HeightField
    margin: Float[Array, "rows columns"] | None = None
    first: tuple[float, float] = (0.0, 0.0)
    cell: float = 1.0

    def ground_ratio(self, x: Floats, y: Floats) -> Float[Array, "n 3"]:
        """Ratio of the light of ground at points of the world."""
        return self.light.ratio(self.surface.at(x, y)[1], self.visible(x, y))

    def visible(self, x: Floats, y: Floats) -> Floats:
        """Share of the sun's disc that is above the horizon."""
        if self.margin is None:
            return np.ones(len(x))
        at = [(y - self.first[1]) / self.cell, (x - self.first[0]) / self.cell]
        tangent = sun_tangent(self.light.sun)
        margin = map_coordinates(self.margin, at, order=1, mode="nearest")
        return np.clip(0.5 + margin / (2 * SOFT * (1 + tangent * tangent)), 0, 1)


def relight(colours: Float[Array, "*#n 3"], ratio: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """sRGB colours in the light of a ratio."""
    return np.clip(colours * ratio ** (1 / GAMMA), 0, 1)


def shade_field(field: GaussianField, ratio: Float[Array, "n 3"]) -> GaussianField:
    """The field in the light of a ratio."""
    sh = field.sh.copy()
    sh[:, 0] = rgb_to_sh(relight(field.base_colours, ratio).astype(np.float32))[:, 0]
    return replace(field, sh=sh)


def place_light(light: Light, surface: HeightField, side: float, eye: Vector) -> PlacedLight:
    """The light around an eye. side: of a tile.

    The grid lies on multiples of its cells in the world and moves by SNAP of them, so the shadow of a place is the
    same from all eyes for which it is not near the grid's edge.
    """
    if isinstance(surface, FlatSurface):
        return PlacedLight(light, surface)
    cell = CELL * side
    column, row = (SNAP * int(np.floor(v / (SNAP * cell) + 0.5)) - SIZE // 2 for v in eye[:2])
    x, y = np.meshgrid((column + np.arange(SIZE)) * cell, (row + np.arange(SIZE)) * cell)
    heights = surface.at(x.ravel(), y.ravel())[0].reshape(SIZE, SIZE)
    margin = measure_margin(heights, cell, light.sun)
    return PlacedLight(light, surface, margin, (column * cell, row * cell), cell)


def sun_tangent(sun: Sun) -> float:
    """Tangent of the sun's elevation."""
    return float(np.tan(np.radians(min(sun.elevation, STEEPEST))))


def measure_margin(heights: Float[Array, "n n"], cell: float, sun: Sun) -> Float[Array, "n n"]:
    """Tangent of the sun's elevation minus the tangent of the horizon's, at each point of a grid of heights.

    heights: rows from the south. Along the edge of the grid the horizon is lowered, so that shadows end softly there.
    """
    n = len(heights)
    rows, columns = np.mgrid[:n, :n].astype(float)
    azimuth, horizon = np.radians(sun.azimuth), np.full(heights.shape, -np.inf)
    for distance in FARTHEST ** (np.arange(STEPS) / (STEPS - 1)):
        at = [rows + distance * np.cos(azimuth), columns + distance * np.sin(azimuth)]
        seen = map_coordinates(heights, at, order=1, mode="nearest")
        horizon = np.maximum(horizon, (seen - heights) / (distance * cell))
    edge = np.minimum(rows, n - 1 - rows)
    inside = np.clip(np.minimum(edge, np.minimum(columns, n - 1 - columns)) / BORDER, 0, 1)
    return np.clip(sun_tangent(sun) - (inside * horizon - (1 - inside)), -MOST_MARGIN, MOST_MARGIN)
