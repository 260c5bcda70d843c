"""Things that stand on the ground: blobs that rise above what is around them, and differ from it in colour.

Blobs are sought at several sizes as differences of Gaussians (Lindeberg 1998). What counts is how far a blob rises
above other blobs of its size in the same material: a stone in a field of stones does not. Its outline is that of the
cells which look more like its core than like the ring around it (Fisher's discriminant).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import (
    binary_dilation,
    binary_fill_holes,
    binary_opening,
    distance_transform_edt,
    gaussian_filter,
    label,
    maximum_filter,
    percentile_filter,
)

from dav_gswt.materials.maps import GroundMaps, Surroundings

DIAMETERS = (1 / 28, 1 / 20, 1 / 14, 1 / 10, 1 / 7)  # of blobs, of the side
AROUND, LOW = 1 / 10, 20  # the ground below: this percentile of the heights within so much of the side
USUAL, UNUSUAL = 0.9, 2.6  # a blob is one if its contrast is so many times this quantile of its material's
LEAST_RISE, LEAST_COLOUR = 0.8, 6.0  # contrasts that are always too small: in cells, and in weighed CIELAB units
COLOUR_SHARE = 1 / 3  # of that contrast of colour, that a thing which rises must have: a fit has heights that are wrong
LEAST_DIFFERENCE = 2.5  # weighed CIELAB units between a thing and its ring
CROWDED = 0.2, 0.3  # share of the ring that looks like the thing, or is nearly as high, from which it is one of many
SIZES = 0.25, 2.2  # area of a thing over that of its blob's disc
BEYOND = 0.04  # of a thing's area: where more goes on beyond its blob, as along a hedge, it is a piece
RISE_WEIGHT = 4.0  # CIELAB units that a cell of height counts in the outline


@dataclass(frozen=True)
class Blob:
    """A blob's middle and diameter in cells. score: of its contrast, 1 for the least that counts."""

    row: int
    column: int
    diameter: float
    score: float


def find_standing_things(around: Surroundings, maps: GroundMaps) -> list[Bool[Array, "m m"]]:
    """Cells of each thing, those of the strongest contrast first; they do not overlap."""
    layers = np.concatenate([RISE_WEIGHT * gaussian_filter(around.rise, 1.0)[..., None], around.features], -1)
    taken, things = np.zeros(maps.known.shape, bool), []
    for blob in find_blobs(around):
        if taken[blob.row, blob.column]:
            continue
        thing = trace_outline(layers, blob)
        if thing is not None and not (thing & taken).any() and maps.known[thing].all():
            things.append(thing)
            taken |= binary_dilation(thing)
    return things


def measure_rise(maps: GroundMaps) -> Float[Array, "m m"]:
    """How far what is seen from above lies over the ground around it, in cells."""
    m = maps.cells
    soft = gaussian_filter(maps.surface, 1.0)
    low = percentile_filter(soft, LOW, size=max(5, round(AROUND * m)))
    return (maps.surface - gaussian_filter(low, AROUND * m / 2)) / maps.exemplar.spacing


def measure_roughness(rise: Float[Array, "m m"], ground: Bool[Array, "m m"]) -> float:
    """Contrast of height, in cells, that the smallest blobs of some ground usually have."""
    return float(np.quantile(_respond(rise, DIAMETERS[0] * len(rise))[ground], USUAL)) if ground.any() else 0.0


def find_blobs(around: Surroundings) -> list[Blob]:
    """Blobs by descending score."""
    m, found = len(around.rise), []
    for diameter in (share * m for share in DIAMETERS):
        up = _respond(around.rise, diameter)
        up = _compare(up, around, LEAST_RISE)
        colour = _compare(np.linalg.norm(_respond(around.features, diameter), axis=-1), around, LEAST_COLOUR)
        score = np.minimum(up, colour / COLOUR_SHARE)
        peaks = (score > 1) & (score == maximum_filter(score, size=max(3, int(diameter / 2))))
        found += [Blob(int(y), int(x), diameter, float(score[y, x])) for y, x in np.argwhere(peaks)]
    return sorted(found, key=lambda blob: -blob.score)


def _respond(values: Float[Array, "m m *k"], diameter: float) -> Float[Array, "m m *k"]:
    """Mean over a blob's middle less that around it."""
    middle, around = (gaussian_filter(values, diameter / n, mode="nearest", axes=(0, 1)) for n in (4, 1.5))
    return middle - around


def _compare(contrast: Float[Array, "m m"], around: Surroundings, least: float) -> Float[Array, "m m"]:
    """Contrasts over what is unusual in their material."""
    over = np.zeros(contrast.shape)
    for number in np.unique(around.materials).tolist():
        own, plain = around.materials == number, around.plain(number) & around.known
        usual = float(np.quantile(contrast[plain], USUAL)) if plain.any() else 0.0
        over[own] = contrast[own] / max(UNUSUAL * usual, least)
    return over


def trace_outline(layers: Float[Array, "m m k"], blob: Blob) -> Bool[Array, "m m"] | None:
    """The cells of a blob's thing; None if it is one of many, is not as large as its blob, goes on beyond it, or
    differs too little.

    layers: weighed height, then colours.
    """
    m, reach = len(layers), int(np.ceil(1.4 * blob.diameter))
    top, left = max(0, blob.row - reach), max(0, blob.column - reach)
    window = np.s_[top : min(m, blob.row + reach + 1), left : min(m, blob.column + reach + 1)]
    values = layers[window]
    rows, columns = np.mgrid[window]
    away = np.hypot(rows - blob.row, columns - blob.column)
    core, ring = away <= max(1.5, 0.3 * blob.diameter), away >= 0.9 * blob.diameter
    if ring.sum() < 20:
        return None
    inner, outer = values[core].mean(0), np.median(values[ring], 0)
    spread = 0.5 * (values[core].var(0) + values[ring].var(0)) + 1
    axis = (inner - outer) / spread
    along = (values @ axis - outer @ axis) / max(float((inner - outer) @ axis), 1e-9)  # 0 in the ring, 1 in the core
    pieces, _ = label(binary_opening(along > 0.5, np.ones((2, 2), bool)) | (away < 1.5))
    whole = binary_fill_holes(pieces == pieces[blob.row - top, blob.column - left])
    own = whole & (away <= 1.3 * blob.diameter)
    if (whole & ~own).sum() > BEYOND * own.sum():
        return None
    area = np.pi * (blob.diameter / 2) ** 2
    if not SIZES[0] * area < own.sum() < SIZES[1] * area or _is_crowded(values, along, own, blob):
        return None
    thing = np.zeros((m, m), bool)
    thing[window] = own
    return thing


def _is_crowded(values: Float[Array, "h w k"], along: Float[Array, "h w"], own: Bool[Array, "h w"], blob: Blob) -> bool:
    """Whether much of what is around a thing looks like it or is as high, or nothing differs from it."""
    gap = distance_transform_edt(~own)
    ring = (gap > 2) & (gap < 0.5 * blob.diameter)
    if not ring.any():
        return True
    height = values[..., 0]
    low = float(np.quantile(height[ring], 0.2))
    high = low + 0.35 * (float(np.quantile(height[own], 0.7)) - low)
    difference = np.linalg.norm(np.median(values[own, 1:], 0) - np.median(values[ring, 1:], 0))
    alike, tall = float((along[ring] > 1 / 3).mean()), float((height[ring] > high).mean())
    return alike > CROWDED[0] or tall > CROWDED[1] or float(difference) < LEAST_DIFFERENCE
