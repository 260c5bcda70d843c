"""Broken rocks as coloured meshes, and craters. Rocks are about 1 across with their centre at the origin; each face has
one colour, as the instances of `mitsuba_scene` need it."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic.meshes import Colours, Mesh, mix_palette, normalize

HARD = 44  # exponent of the hull of planes: edges hardly worn
DEPTH = 0.20  # of a fresh crater, in diameters
RIM = 0.06  # height of a fresh crater's rim above the plain, in diameters


def make_rock(rng: np.random.Generator, subdivisions: int, palette: Colours) -> Mesh:
    """A broken rock: a sphere cut by few random planes with sharp edges, rough at all scales, pitted, dusty on top.

    Compared with `meshes.make_stone`, the amplitude of the roughness falls with its wavelength.
    """
    import trimesh  # deferred, as in `meshes.make_stone`

    icosphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    sphere, faces = np.array(icosphere.vertices), np.array(icosphere.faces)
    radius = _hull(rng, sphere) * (1 + _roughness(rng, sphere)) - _pits(rng, sphere)
    squeeze = np.array([1.0, rng.uniform(0.62, 0.95), rng.uniform(0.45, 0.85)])
    corners = (0.5 * sphere * radius[:, None] * squeeze)[faces]
    normal = normalize(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    rocky, settled = palette
    tone = np.exp(0.9 * _roughness(rng, sphere[faces[:, 0]]) + rng.normal(0, 0.06, len(faces)))
    dust = np.clip(1.6 * normal[:, 2] - rng.uniform(0.3, 1.2), 0, 0.85)[:, None]
    colours = mix_palette(rng, rocky) * tone[:, None] * (1 - dust) + dust * settled
    by_vertex = np.clip(colours, 0.01, 0.9).repeat(3, axis=0).astype(np.float32)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(3 * len(faces)).reshape(-1, 3), by_vertex)


def _hull(rng, sphere) -> Float[Array, "v"]:
    """The radius of the inner hull of random planes; the formula is that of `meshes.make_stone`."""
    count = int(rng.integers(7, 13))
    normals = np.concatenate([normalize(rng.standard_normal((count, 3))), np.eye(3), -np.eye(3)])
    distance = np.concatenate([rng.uniform(0.55, 1.0, count), np.ones(6)])
    return ((np.maximum(sphere @ normals.T, 0) / distance) ** HARD).sum(axis=1) ** (-1 / HARD)


def _roughness(rng, at, octaves: int = 4) -> Float[Array, "v"]:
    """Octaves of waves about 0, up to 0.15 or so."""
    total = np.zeros(len(at))
    for octave in range(octaves):
        waves = normalize(rng.standard_normal((9, 3))) * 2.6 * 2.0**octave * rng.uniform(0.7, 1.4, (9, 1))
        total += 0.085 * 0.55**octave * np.cos(at @ waves.T + rng.uniform(0, 2 * np.pi, 9)).sum(axis=1) / 3
    return total


def _pits(rng, sphere) -> Float[Array, "v"]:
    """Depth of round pits, from none to many on a rock."""
    count = int(rng.integers(0, 26))
    if not count:
        return np.zeros(len(sphere))
    centre, width = normalize(rng.standard_normal((count, 3))), rng.uniform(0.06, 0.16, count)
    off = 2 * (1 - sphere @ centre.T) / width**2
    return (0.35 * width * np.exp(-off)).max(axis=1)


def draw_craters(rng: np.random.Generator, count: int, side: float, least: float, most: float) -> Float[Array, "n 4"]:
    """Random craters on a square about the origin: x, y, diameter, freshness from 0.15 to 1.

    The number of craters above a diameter d falls as d^-2, as on ground that is saturated with craters.
    """
    u = rng.uniform(size=count)
    diameter = (least**-2.0 + u * (most**-2.0 - least**-2.0)) ** -0.5
    fresh = 0.15 + 0.85 * rng.uniform(size=count) ** 1.4
    return np.column_stack([rng.uniform(-side / 2, side / 2, (count, 2)), np.sort(diameter)[::-1], fresh])


def crater_relief(x, y, craters: Float[Array, "n 4"], shape: Float[Array, "n 6"]) -> Array:
    """The height that craters add at places: a bowl, a rim, and the ejecta around it.

    With r the distance in radii, which varies with the azimuth by `shape`, and d the diameter, a fresh crater adds
    -DEPTH d (1 - r^2.4) + RIM d r^2.4 inside and RIM d r^-3.4 outside, which ends at 3.5 radii; an old crater is lower
    and softer.
    """
    total = np.zeros(np.shape(x))
    for (cx, cy, d, fresh), bend in zip(craters, shape, strict=True):
        near = np.abs(x - cx) + np.abs(y - cy) < 3.6 * d / 2 * 1.42
        dx, dy = x[near] - cx, y[near] - cy
        turn = np.arctan2(dy, dx)
        waves = bend[0] * np.cos(2 * turn + bend[3]) + bend[1] * np.cos(3 * turn + bend[4])
        r = np.hypot(dx, dy) / (d / 2) / (1 + waves + bend[2] * np.cos(7 * turn + bend[5]))
        soft = 0.05 + 0.25 * (1 - fresh)
        inside = r**2.4 * (DEPTH + RIM) - DEPTH
        outside = RIM * np.maximum(r, 0.3) ** -3.4 * np.clip((3.5 - r) / 2.0, 0, 1)
        share = 0.5 + 0.5 * np.tanh((r - 1) / soft)
        total[near] += fresh * d * (np.minimum(inside, RIM) * (1 - share) + np.minimum(outside, RIM) * share)
    return total


def draw_outlines(rng: np.random.Generator, count: int) -> Float[Array, "n 6"]:
    """Irregular outlines of craters: amplitudes of three waves over the azimuth, and their phases."""
    amplitude = np.abs(rng.normal(0, [0.06, 0.045, 0.02], (count, 3)))
    return np.column_stack([amplitude, rng.uniform(0, 2 * np.pi, (count, 3))])


def draw_sizes(rng: np.random.Generator, count: int, least: float, most: float, steep: float) -> Float[Array, "n"]:
    """Random sizes between least and most, whose density falls as size^-steep (steep is not 1)."""
    power = 1 - steep
    return (least**power + rng.uniform(size=count) * (most**power - least**power)) ** (1 / power)
