"""The ground layer: one flat Gaussian (disc) a cell, and the underlay, so that no sky shines through from near.

Discs are fitted to pixels: between two small ones there may be a gap that no photo resolves, but that is visible from
nearer or from the side. The underlay, large opaque discs just below the ground, fills it with the colour of the ground
around. It lies below the lowest disc around, follows the discs, and gets no gradient.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter, uniform_filter

from dav_gswt import arrays
from dav_gswt.field import SH0, GaussianField, rgb_to_sh
from dav_gswt.reconstruction.ground import Ground

WIDTH = 0.72  # standard deviation of a disc in spacings: neighbours overlap, the ground is opaque
THICKNESS = 0.1  # of a disc, in spacings
OPAQUE = 4.0  # opacity logit of a disc before the first step
OBJECT_HEIGHT = 1.5  # spacings above the surface, from which a Gaussian belongs to an object
STRIDE = 2  # cells a side below which one disc of the underlay lies
UNDERLAY_WIDTH = 0.8  # standard deviation of such a disc, in its own spacings
DEPTH = 1.0  # spacings of the underlay under the lowest disc around
SOLID = 6.0  # opacity logit of the underlay


def slopes_to_quaternions(east: Float[Any, "n"], north: Float[Any, "n"]) -> Float32[Any, "n 4"]:
    """The shortest rotation (w x y z) from +z to the normal of a surface with these slopes."""
    xp = arrays.namespace(east)
    length = xp.sqrt(east * east + north * north + 1)  # of the normal (-east, -north, 1)
    # half-way quaternion: (1 + z.n, z x n); column after column, as NumPy is slow along an axis of 3
    w, x, y = 1 + 1 / length, north / length, -east / length
    size = xp.sqrt(w * w + x * x + y * y)
    return arrays.to_single(xp.stack([w / size, x / size, y / size, xp.zeros_like(w)], 1))


def make_ground_discs(grid: Ground, colours: Float[Array, "n 3"]) -> GaussianField:
    """One disc a cell, tangent to the surface and stretched by its slope, so that slopes have no holes."""
    n = grid.heights.size
    east, north = (s.ravel() for s in grid.slopes())
    stretch = np.sqrt(1 + east**2 + north**2)
    scales = np.full((n, 3), WIDTH * grid.spacing) * np.stack([stretch, stretch, np.ones(n)], 1)
    scales[:, 2] = THICKNESS * grid.spacing
    return GaussianField(
        grid.centres.astype(np.float32),
        np.log(scales).astype(np.float32),
        slopes_to_quaternions(east, north),
        np.full(n, OPAQUE, np.float32),
        rgb_to_sh(colours),
        np.where(grid.seen.ravel(), 0, 1).astype(np.float32),
        np.ones(n, bool),
    )


def fill_unknown(colours: Float[Array, "n 3"], known: Bool[Array, "rows columns"]) -> Float32[Array, "n 3"]:
    """Colours with unknown cells filled from the nearest known ones and blurred; grey if none is known."""
    image = np.where(known[..., None], colours.reshape(*known.shape, 3), 0)
    if not known.any():
        return np.full((known.size, 3), 0.5, np.float32)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    spread = image[tuple(nearest)]
    soft = np.stack([gaussian_filter(spread[..., c], 3.0, mode="nearest") for c in range(3)], -1)
    return np.where(known[..., None], image, soft).reshape(-1, 3).astype(np.float32)


def count_underlay(grid: Ground) -> int:
    """Number of Gaussians of a grid's underlay."""
    rows, columns = grid.shape
    return -(-rows // STRIDE) * -(-columns // STRIDE)


def find_underlay(field: GaussianField, grid: Ground) -> slice:
    """The rows of the underlay in a field over this grid: right after the discs; empty without one."""
    first, last = grid.heights.size, grid.heights.size + count_underlay(grid)
    part = field.opacity_logits[first:last]
    there = len(part) == last - first and bool((part == SOLID).all()) and not field.ground[first:last].any()
    return slice(first, last if there and field.ground.any() else first)


def remove_underlay(field: GaussianField, grid: Ground) -> GaussianField:
    """The field without its underlay: the discs, then the objects on them."""
    under = find_underlay(field, grid)
    if under.start == under.stop:  # a finished field may have fewer Gaussians than cells
        return field
    return field[np.r_[0 : under.start, under.stop : len(field)]]


def copy_uncertainty(field: GaussianField, grid: Ground) -> GaussianField:
    """The field with its underlay as uncertain as the discs above it."""
    part = find_underlay(field, grid)
    uncertainty = field.uncertainty.copy()
    if part.stop > part.start:
        above = uncertainty[: grid.heights.size].reshape(grid.shape)
        uncertainty[part] = uniform_filter(above, STRIDE, mode="nearest")[::STRIDE, ::STRIDE].ravel()
    return replace(field, uncertainty=uncertainty)


def make_underlay(grid: Ground, layer: GaussianField) -> GaussianField:
    """The underlay of a field whose first Gaussians are the grid's discs."""
    n, s = count_underlay(grid), grid.spacing
    scales = np.full((n, 3), np.log(UNDERLAY_WIDTH * STRIDE * s), np.float32)
    scales[:, 2] = np.log(THICKNESS * s)
    above = slice(0, grid.heights.size)
    heights, quats, colours = place_underlay(grid, layer.means[above, 2], layer.base_colours[above])
    rows, columns = np.meshgrid(*(np.arange(0, n, STRIDE) for n in grid.shape), indexing="ij")
    half = 0.5 * STRIDE
    x, y = grid.west + (columns + half) * s, grid.south + (rows + half) * s
    means = np.stack([x.ravel(), y.ravel(), heights], 1).astype(np.float32)
    sh = np.zeros((n, *layer.sh.shape[1:]), np.float32)
    sh[:, :1] = rgb_to_sh(colours)
    return GaussianField(
        means, scales, quats, np.full(n, SOLID, np.float32), sh, np.zeros(n, np.float32), np.zeros(n, bool)
    )


def update_underlay(grid: Ground, values: dict[str, Any]) -> None:
    """Update the underlay, the rows after the discs, to the discs' current heights and colours, in place."""
    first, last = grid.heights.size, grid.heights.size + count_underlay(grid)
    base = values["colours"][:first, 0] * np.float32(SH0) + 0.5
    heights, values["quats"][first:last], colours = place_underlay(grid, values["means"][:first, 2], base)
    values["means"][first:last, 2] = arrays.to_single(heights)
    values["colours"][first:last, :1] = rgb_to_sh(colours)


def place_underlay(grid: Ground, heights: Float[Any, "n"], colours: Float[Any, "n 3"]):
    """Heights, quaternions and colours of the underlay of discs with these heights and colours."""
    z = arrays.to_double(heights.reshape(grid.shape))
    pick = np.s_[0::STRIDE, 0::STRIDE]
    smoothed = arrays.average_around(z, 2 * STRIDE + 1)
    east, north = (g[pick].reshape(-1) for g in arrays.measure_slopes(smoothed, grid.spacing))
    low = arrays.find_lowest_around(z, STRIDE + 1)[pick] - DEPTH * grid.spacing
    image = colours.reshape(*grid.shape, 3)
    soft = [arrays.average_around(image[..., c], STRIDE + 1)[pick] for c in range(3)]
    return (
        low.reshape(-1),
        slopes_to_quaternions(east, north),
        arrays.namespace(image).stack(soft, -1).reshape(-1, 3),
    )
