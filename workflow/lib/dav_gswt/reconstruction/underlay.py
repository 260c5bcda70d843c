"""The underlay: large opaque discs just below the ground, so that no sky shines through from nearer than the photos.

Discs are fitted to pixels: between two that shrank to grains there may be a gap that no photo resolves, and that
anybody sees who comes nearer or looks from the side. The underlay shows there, in the colour of the ground around. It
is no second ground: it lies under the lowest disc around, follows the discs, and no gradient moves it.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import minimum_filter, uniform_filter

from dav_gswt.field import SH0, GaussianField, rgb_to_sh
from dav_gswt.reconstruction.discs import THICKNESS, quaternions
from dav_gswt.reconstruction.ground import Ground

STRIDE = 2  # cells a side that one disc of it lies under
WIDTH = 0.8  # standard deviation, in its own spacings
DEPTH = 1.0  # spacings under the lowest disc around
SOLID = 6.0  # opacity logit


def count(grid: Ground) -> int:
    """How many Gaussians the underlay of a grid has."""
    rows, columns = grid.shape
    return -(-rows // STRIDE) * -(-columns // STRIDE)


def rows(field: GaussianField, grid: Ground) -> slice:
    """Where a field over this grid has its underlay: right after the discs; empty if it has none."""
    first, last = grid.heights.size, grid.heights.size + count(grid)
    part = field.opacity_logits[first:last]
    there = len(part) == last - first and bool((part == SOLID).all()) and not field.ground[first:last].any()
    return slice(first, last if there and field.ground.any() else first)


def without(field: GaussianField, grid: Ground) -> GaussianField:
    """The field without its underlay: the discs, then what stands on them. All of one that has none."""
    under = rows(field, grid)
    if under.start == under.stop:  # perhaps beyond the end: a finished field may have fewer Gaussians than cells
        return field
    return field[np.r_[0 : under.start, under.stop : len(field)]]


def as_sure(field: GaussianField, grid: Ground) -> GaussianField:
    """The field with its underlay as uncertain as the discs above it: no photo is to see it."""
    part = rows(field, grid)
    doubt = field.uncertainty.copy()
    if part.stop > part.start:
        above = doubt[: grid.heights.size].reshape(grid.shape)
        doubt[part] = uniform_filter(above, STRIDE, mode="nearest")[::STRIDE, ::STRIDE].ravel()
    return replace(field, uncertainty=doubt)


def beneath(grid: Ground, layer: GaussianField) -> GaussianField:
    """The underlay of a field whose first Gaussians are the grid's discs."""
    n, s = count(grid), grid.spacing
    scales = np.full((n, 3), np.log(WIDTH * STRIDE * s), np.float32)
    scales[:, 2] = np.log(THICKNESS * s)
    means, quats, colours = places(grid, layer.means[: grid.heights.size, 2], layer.base_colours[: grid.heights.size])
    sh = np.zeros((n, *layer.sh.shape[1:]), np.float32)
    sh[:, :1] = rgb_to_sh(colours)
    return GaussianField(
        means, scales, quats, np.full(n, SOLID, np.float32), sh, np.zeros(n, np.float32), np.zeros(n, bool)
    )


def follow(grid: Ground, values: dict[str, Array]) -> None:
    """Bring the underlay, the rows after the discs', to where and what the discs are now, in place."""
    first, last = grid.heights.size, grid.heights.size + count(grid)
    base = 0.5 + np.float32(SH0) * values["colours"][:first, 0]
    values["means"][first:last], values["quats"][first:last], colours = places(grid, values["means"][:first, 2], base)
    values["colours"][first:last, :1] = rgb_to_sh(colours)


def places(grid: Ground, heights: Float[Array, "n"], colours: Float[Array, "n 3"]):
    """Means, quaternions and colours of the underlay of discs with these heights and colours."""
    z = heights.reshape(grid.shape).astype(float)
    pick = np.s_[0::STRIDE, 0::STRIDE]
    north, east = (g[pick] for g in np.gradient(uniform_filter(z, 2 * STRIDE + 1, mode="nearest"), grid.spacing))
    rows, columns = np.meshgrid(*(np.arange(0, n, STRIDE) for n in grid.shape), indexing="ij")
    low = minimum_filter(z, STRIDE + 1, mode="nearest")[pick] - DEPTH * grid.spacing
    half = 0.5 * STRIDE
    x, y = grid.west + (columns + half) * grid.spacing, grid.south + (rows + half) * grid.spacing
    means = np.stack([x.ravel(), y.ravel(), low.ravel()], 1).astype(np.float32)
    image = colours.reshape(*grid.shape, 3)
    soft = np.stack([uniform_filter(image[..., c], STRIDE + 1, mode="nearest")[pick] for c in range(3)], -1)
    return means, quaternions(east.ravel(), north.ravel()), soft.reshape(-1, 3)
