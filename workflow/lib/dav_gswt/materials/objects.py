"""Objects: single things within a material that differ from the ground around them, within a closed outline.

Dense growth is texture, not objects: where much of a material is covered, nothing is taken out of it.
Shade is neither: it may be other ground in less light.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.ndimage import (
    binary_closing,
    binary_dilation,
    binary_fill_holes,
    binary_opening,
    distance_transform_edt,
    gaussian_filter,
    label,
)

from dav_gswt.images.srgb import decode_srgb
from dav_gswt.materials.maps import GroundMaps, Surroundings, unite

AROUND = 1 / 10  # of the side: blur that gives the ground around a thing
ROUNDS = 3  # of the estimate of that ground, each without what stood out in the last
SURE, LIKELY = 6.0, 3.5  # robust standard deviations from the ground around: of an object's core, and of its rim
NOTICEABLE = 4.0  # weighed CIELAB units that such a deviation has at least: even ground has little spread
SMALLEST = 1 / 30  # of the side: smaller things are texture
SMALLEST_STANDING = 1 / 22  # of the side, likewise: growth and rough ground have blobs of all sizes
LARGEST = 0.13  # of the side: larger things are ground that is not tiled
BORDER = 2  # cells: nearer to the border of the exemplar a thing may be cut off
MIN_FILL = 0.35  # of its bounding box that an object fills
MAX_STRETCH = 3.5  # length over width
MIN_SOLIDITY, SPLIT_SOLIDITY = 0.7, 0.8  # of its convex hull that an object fills; below the second it is split
RING = 3  # cells around an object
OPEN, WITHIN = 0.45, 0.7  # share of these that is plain ground, and share of that which is its material's
MANY = 0.5  # area of smaller things of a thing's colour over its own, from which it is the largest of many
COMMON, NEAR = 0.15, 0.6  # share of a material that looks like a thing, from which it is texture; and how near that is,
# over the thing's difference from what is usual
ALIKE = 0.85  # cosine of the angle between the differences of two things of one colour
MARKER, LEAST_CONTRAST = 2.2, 0.12  # contrast of a marker over its material's, and the least that this counts as
OTHER = 0.5  # of what stands out, that is ground of another material: then it is a piece of that, not a thing
DENSE = 0.25  # of a material that is covered by things: then they are texture
SHADE = 0.75  # of a material's light, in every channel, at most: darker and bluer is its shade
BLUER = 1.1  # ratio of blue light to red in the shade over that in the sun, at least


@dataclass(frozen=True)
class Footprint:
    """An object from above: its cells (rows, columns), and the material around it."""

    cells: Bool[Array, "m m"]
    material: int


def find_outliers(features: Float[Array, "m m k"], maps: GroundMaps, ground: Bool[Array, "m m"]) -> Bool[Array, "m m"]:
    """Cells of a material that stand out of the ground around them by colour or by height.

    ground: the material's cells. The ground around is a blur over the cells that do not stand out.
    """
    from skimage.filters import apply_hysteresis_threshold  # here, not above: it takes half a second to load

    relief = maps.height / maps.exemplar.spacing  # cells
    values = np.concatenate([features, relief[..., None]], -1)
    plain = ground & maps.known
    score = np.zeros(ground.shape)
    for _ in range(ROUNDS):
        if plain.sum() < 0.1 * ground.sum():
            break
        score = measure_deviation(values, plain)
        plain = ground & maps.known & (score < LIKELY)
    return apply_hysteresis_threshold(np.where(ground, score, 0), LIKELY, SURE)


def measure_deviation(values: Float[Array, "m m k"], plain: Bool[Array, "m m"]) -> Float[Array, "m m"]:
    """How far each cell is from plain ground around it: the most robust standard deviations in any of its values.

    values: three of colour, then, if any, relief in cells. plain: the ground to compare with, not empty.
    """
    m, least = len(values), np.array([NOTICEABLE] * 3 + [1.0]) / SURE
    weight = gaussian_filter(plain.astype(float), AROUND * m, mode="nearest")
    layers = [np.where(plain, layer, 0) for layer in np.moveaxis(values, -1, 0)]
    mean = np.stack([gaussian_filter(layer, AROUND * m, mode="nearest") for layer in layers], -1)
    away = values - mean / np.maximum(weight, 1e-6)[..., None]
    spread = np.maximum(1.4826 * np.median(np.abs(away[plain]), 0), least[: values.shape[-1]])
    return np.abs(away / spread).max(-1)


def find_footprints(
    standing: list[Bool[Array, "m m"]], candidates: Bool[Array, "m m"], around: Surroundings
) -> tuple[list[Footprint], Bool[Array, "m m"]]:
    """Objects, and the cells of everything else that is no texture.

    Things at the border of the exemplar are cut off, so they are no objects; nor are things that are
    long, frayed or large, lie between two materials, are small pieces of another
    material, shade, or markers. On rough ground the largest of many specks, and a thing of a colour
    that much of the ground has, is texture.

    Args:
        standing: cells of each thing that stands on the ground.
        candidates: cells that stand out by colour or height.
    Returns: footprints; cells to be filled beside them.
    """
    least = SMALLEST_STANDING * len(candidates)
    footprints, excluded = [], ~around.known
    tall, flat = _join_rims([own for own in standing if measure_size(own) >= least], candidates)
    small = [own for own in flat if measure_size(own) < least]
    for number, own in enumerate([*tall, *flat]):
        material = around.material_of(own)
        rough, stands = material in around.rough, number < len(tall)
        piece = not stands and around.pieces[own].mean() >= OTHER
        if not stands and measure_size(own) < (least if rough else SMALLEST * len(candidates)):
            continue
        many = rough and not stands and not piece and _is_one_of_many(own, material, small, around)
        if many or (rough and not piece and _is_texture(own, material, around)):
            continue
        unwanted = not stands and (piece or _is_shaded(own, material, around) or _is_marker(own, material, around))
        if not unwanted and _is_single(own, material, around):
            footprints.append(Footprint(own, material))
        else:
            excluded = excluded | own
    return footprints, excluded


def _join_rims(
    tall: list[Bool[Array, "m m"]], candidates: Bool[Array, "m m"]
) -> tuple[list[Bool[Array, "m m"]], list[Bool[Array, "m m"]]]:
    """Standing things with what lies along them and is smaller, as contact shadow, and all other things.

    What would make a thing less compact is not joined. A thing that has grown may touch more, until none grows.
    """
    while True:
        taken = unite([binary_dilation(own) for own in tall], candidates.shape)
        rest, grown = [], list(tall)
        for rim in split_things(_clean(candidates & ~taken) & ~taken):  # an annulus is not filled with its core
            around = binary_dilation(rim, iterations=2)
            touched = [k for k, own in enumerate(grown) if (around & own).any()]
            if len(touched) == 1 and rim.sum() < grown[touched[0]].sum():
                joined = binary_closing(grown[touched[0]] | rim, np.ones((3, 3), bool))
                if _is_compact(joined):
                    grown[touched[0]] = joined
                    continue
            rest.append(rim)
        if all((a == b).all() for a, b in zip(tall, grown, strict=True)):
            return tall, rest
        tall = grown


def _is_shaded(own: Bool[Array, "m m"], material: int, around: Surroundings) -> bool:
    """Whether a thing looks like shade of its material."""
    plain = around.plain(material)
    return bool(plain.any() and is_shade(linear_light(around.colour[own]), linear_light(around.colour[plain])))


def _is_marker(own: Bool[Array, "m m"], material: int, around: Surroundings) -> bool:
    """Whether a thing is far richer in contrast than its material, as a survey's marker in black and white.

    Cells that hardly differ from the ground do not count: the rim of a thing shows ground.
    """
    plain, bright = around.plain(material), around.colour.mean(-1)
    if not plain.any():
        return False
    away = np.abs(bright[own] - np.median(bright[plain]))
    core = bright[own][away >= 0.5 * np.quantile(away, 0.95)]
    inside, outside = np.ptp(np.quantile(core, [0.05, 0.95])), np.ptp(np.quantile(bright[plain], [0.01, 0.99]))
    return bool(inside > MARKER * max(float(outside), LEAST_CONTRAST))


def split_things(cells: Bool[Array, "m m"]) -> list[Bool[Array, "m m"]]:
    """Connected things; one with bays in its outline is split where it is narrow, if its parts are compact.

    Parts are the basins of the distance to what is no thing (Beucher and Lantuejoul 1979).
    """
    from skimage.feature import peak_local_max  # here, not above: they take half a second to load
    from skimage.segmentation import watershed

    pieces, number = label(cells, np.ones((3, 3), bool))
    things, apart = [], max(2, round(SMALLEST * len(cells) / 2))
    for k in range(1, number + 1):
        own = pieces == k
        inner = gaussian_filter(distance_transform_edt(own), 1.0) * own
        peaks = peak_local_max(inner, min_distance=apart, labels=own.astype(int), exclude_border=False)
        if len(peaks) < 2 or _describe(own).solidity >= SPLIT_SOLIDITY:
            things.append(own)
            continue
        marks = np.zeros(own.shape, int)
        marks[tuple(peaks.T)] = 1 + np.arange(len(peaks))
        basins = watershed(-inner, marks, mask=own)
        parts = [basins == mark for mark in range(1, len(peaks) + 1)]
        things += parts if sum(_is_compact(part) for part in parts) > len(parts) / 2 else [own]
    return things


def _is_single(own: Bool[Array, "m m"], material: int, around: Surroundings) -> bool:
    """Whether a thing is an object: compact, and within ground of one material."""
    ring = binary_dilation(own, iterations=RING) & ~own
    plain = around.ground[ring]
    within = plain.mean() >= OPEN and (around.materials[ring] == material)[plain].mean() >= WITHIN
    return bool(within and _is_compact(own) and around.known[own].all() and not around.strips[ring].any())


def _is_one_of_many(
    own: Bool[Array, "m m"], material: int, small: list[Bool[Array, "m m"]], around: Surroundings
) -> bool:
    """Whether smaller things differ from its material as it does and cover as much of it, as blooms in a meadow."""
    plain = around.plain(material)
    if not plain.any():
        return False
    usual = np.median(around.features[plain], 0)
    away, area = np.median(around.features[own], 0) - usual, 0
    for other in small:
        if around.material_of(other) == material:
            step = np.median(around.features[other], 0) - usual
            length = max(float(np.linalg.norm(step) * np.linalg.norm(away)), 1e-9)
            area += int(other.sum()) if float(step @ away) > ALIKE * length else 0
    return bool(area >= MANY * own.sum())


def _is_texture(own: Bool[Array, "m m"], material: int, around: Surroundings) -> bool:
    """Whether much of its material has the colour of a thing, as among stones."""
    plain = around.plain(material) & ~own
    if not plain.any():
        return False
    colours, typical = around.features[plain], np.median(around.features[own], 0)
    difference = float(np.linalg.norm(typical - np.median(colours, 0)))
    return bool((np.linalg.norm(colours - typical, axis=1) < NEAR * difference).mean() > COMMON)


def measure_size(cells: Bool[Array, "m m"]) -> int:
    """The longer side of the bounding box."""
    return max(_describe(cells).image.shape)


def _describe(own: Bool[Array, "m m"]) -> Any:
    """Box, area and solidity (share of the convex hull) of a thing."""
    from skimage.measure import regionprops  # here, not above: it takes half a second to load

    return regionprops(own.astype(np.uint8))[0]


def _is_compact(own: Bool[Array, "m m"]) -> bool:
    """Whether a thing is whole, compact and not too large."""
    m, thing = len(own), _describe(own)
    short, long = sorted(thing.image.shape)
    whole = min(thing.bbox) >= BORDER and max(thing.bbox) <= m - BORDER
    compact = long <= MAX_STRETCH * short and thing.extent >= MIN_FILL and thing.solidity >= MIN_SOLIDITY
    return bool(whole and compact and long <= LARGEST * m)


def _clean(cells: Bool[Array, "m m"]) -> Bool[Array, "m m"]:
    """Without threads and specks, and without holes; what is wider than a thing is no hole but ground in a ring."""
    whole = binary_closing(binary_opening(cells, np.ones((2, 2), bool)), np.ones((3, 3), bool))
    holes, number = label(binary_fill_holes(whole) & ~whole)
    widest = np.zeros(number + 1)
    np.maximum.at(widest, holes.ravel(), 2 * distance_transform_edt(~whole).ravel())
    widest[0] = np.inf  # what is no hole
    return whole | (widest <= LARGEST * len(cells))[holes]


def linear_light(colour: Float[Array, "n 3"]) -> Float[Array, "3"]:
    """Mean linear light of sRGB colours."""
    return decode_srgb(colour).mean(0)


def is_shade(light: Float[Array, "3"], other: Float[Array, "3"]) -> bool:
    """Whether ground of this light may be the other in shade: darker in all channels, and bluer, as the sky is."""
    red, green, blue = light / np.maximum(other, 1e-6)
    return bool(max(red, green, blue) < SHADE and blue >= BLUER * red and green >= red)
