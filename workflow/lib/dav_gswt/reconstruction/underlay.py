"""The underlay: large opaque discs just below the ground, so that no sky shines through from nearer than the photos.

Discs are fitted to pixels: between two small ones there may be a gap that no photo resolves, but that is visible from
nearer or from the side. The underlay fills it with the colour of the ground around. It lies below the lowest disc
around, follows the discs, and gets no gradient.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import minimum_filter, uniform_filter

from dav_gswt.field import SH0, GaussianField, rgb_to_sh
from dav_gswt.reconstruction.discs import THICKNESS, slopes_to_quaternions
from dav_gswt.reconstruction.ground import Ground

STRIDE = 2  # cells a side below which one disc lies
WIDTH = 0.8  # standard deviation, in its own spacings
DEPTH = 1.0  # spacings under the lowest disc around
SOLID = 6.0  # opacity logit


def count_gaussians(grid: Ground) -> int:
    """Number of Gaussians of a grid's underlay."""
    rows, columns = grid.shape
    return -(-rows // STRIDE) * -(-columns // STRIDE)


def find_rows(field: GaussianField, grid: Ground) -> slice:
    """The rows of the underlay in a field over this grid: right after the discs; empty without one."""
    first, last = grid.heights.size, grid.heights.size + count_gaussians(grid)
    part = field.opacity_logits[first:last]
    there = len(part) == last - first and bool((part == SOLID).all()) and not field.ground[first:last].any()
    return slice(first, last if there and field.ground.any() else first)


def remove_underlay(field: GaussianField, grid: Ground) -> GaussianField:
    """The field without its underlay: the discs, then the objects on them."""
    under = find_rows(field, grid)
    if under.start == under.stop:  # a finished field may have fewer Gaussians than cells
        return field
    return field[np.r_[0 : under.start, under.stop : len(field)]]


def copy_uncertainty(field: GaussianField, grid: Ground) -> GaussianField:
    """The field with its underlay as uncertain as the discs above it."""
    part = find_rows(field, grid)
    uncertainty = field.uncertainty.copy()
    if part.stop > part.start:
        above = uncertainty[: grid.heights.size].reshape(grid.shape)
        uncertainty[part] = uniform_filter(above, STRIDE, mode="nearest")[::STRIDE, ::STRIDE].ravel()
    return replace(field, uncertainty=uncertainty)


def make_underlay(grid: Ground, layer: GaussianField) -> GaussianField:
    """The underlay of a field whose first Gaussians are the grid's discs."""
    n, s = count_gaussians(grid), grid.spacing
    scales = np.full((n, 3), np.log(WIDTH * STRIDE * s), np.float32)
    scales[:, 2] = np.log(THICKNESS * s)
    means, quats, colours = place_underlay(
        grid, layer.means[: grid.heights.size, 2], layer.base_colours[: grid.heights.size]
    )
    sh = np.zeros((n, *layer.sh.shape[1:]), np.float32)
    sh[:, :1] = rgb_to_sh(colours)
    return GaussianField(
        means, scales, quats, np.full(n, SOLID, np.float32), sh, np.zeros(n, np.float32), np.zeros(n, bool)
    )


def update_underlay(grid: Ground, values: dict[str, Array]) -> None:
    """Update the underlay, the rows after the discs, to the discs' current heights and colours, in place."""
    first, last = grid.heights.size, grid.heights.size + count_gaussians(grid)
    base = 0.5 + np.float32(SH0) * values["colours"][:first, 0]
    values["means"][first:last], values["quats"][first:last], colours = place_underlay(
        grid, values["means"][:first, 2], base
    )
    values["colours"][first:last, :1] = rgb_to_sh(colours)


def place_underlay(grid: Ground, heights: Float[Array, "n"], colours: Float[Array, "n 3"]):
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
    return means, slopes_to_quaternions(east.ravel(), north.ravel()), soft.reshape(-1, 3)
