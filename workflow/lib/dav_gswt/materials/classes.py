"""Which cells of an exemplar belong to which material, which to an object, and which are not tiled at all."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, label

from dav_gswt.materials import objects, segmentation
from dav_gswt.materials.maps import GroundMaps
from dav_gswt.materials.objects import Footprint

MAX_MATERIALS = 4
LEAST_SHARE = 0.05  # of the exemplar, of a material
LEAST_WIDTH = 0.13  # of its side: a disc so wide lies in a material
FINE = 0.1  # of its side: classes that are nowhere wider are growth or things; where they are dense, they are texture
SHADE = 0.75  # of a material's light, in every channel, at most: darker and bluer is its shade
MORE_GRAIN = 1.6  # times a material's contrast: rougher ground is no shade of it (that under trees is dappled)
SCATTERED = 0.03  # of the exemplar: a smaller and narrow piece of a material, within another, is a thing on that
BLUER = 1.1  # ratio of blue light to red in the shade over that in the sun, at least


@dataclass(frozen=True)
class GroundClasses:
    """The classes of an exemplar's cells.

    Attributes:
        materials: of every cell, by number; cells of objects and of excluded ground have the nearest one's.
        footprints: the objects.
        excluded: cells that are shown nowhere: shade, what is rare or cut off, ground that no photo saw.
        number: of materials.
    """

    materials: Int[Array, "m m"]
    footprints: list[Footprint]
    excluded: Bool[Array, "m m"]
    number: int

    @property
    def occupied(self) -> Bool[Array, "m m"]:
        """Cells of objects."""
        cells = np.zeros(self.materials.shape, bool)
        for footprint in self.footprints:
            cells |= footprint.cells
        return cells

    def source(self, material: int) -> Bool[Array, "m m"]:
        """Cells that a material is made of."""
        return (self.materials == material) & ~self.excluded & ~self.occupied

    @property
    def shares(self) -> Float[Array, "k"]:
        """Of all ground that is not excluded, by material; they sum to 1."""
        count = np.bincount(self.materials[~self.excluded], minlength=self.number)
        return count / max(count.sum(), 1)


def classify_ground(maps: GroundMaps) -> GroundClasses:
    """Find materials and objects.

    A class is a material if it is wide somewhere, common enough, and not the shade of another; at most MAX_MATERIALS
    are kept, the largest. Without any, all of the ground is one material. What is left is objects and excluded ground.
    """
    classes = segmentation.segment_ground(maps.colour)
    features = segmentation.describe_cells(maps.colour)
    chosen = choose_materials(classes, maps.colour, features[..., -1])
    wide = np.isin(classes, chosen) & maps.known & ~find_scattered(classes, chosen)
    nearest = tuple(distance_transform_edt(~wide, return_distances=False, return_indices=True))
    materials = np.searchsorted(chosen, classes[nearest])
    wide |= find_growth(classes, chosen) & maps.known
    things = ~wide & maps.known
    for number in range(len(chosen)):
        own = materials == number
        found = objects.find_outliers(features[..., :3], maps, own & wide) | (things & own)
        things = things & ~own | (found & own)
        if objects.is_dense(found & wide, own):
            things = things & ~(own & wide)
    footprints, excluded = objects.find_footprints(things, materials, maps.known)
    return GroundClasses(materials, footprints, excluded, len(chosen))


def find_scattered(classes: Int[Array, "m m"], chosen: list[int]) -> Bool[Array, "m m"]:
    """Cells of small pieces of materials that lie within others."""
    scattered = np.zeros(classes.shape, bool)
    for number in chosen if len(chosen) > 1 else ():
        pieces, _ = label(classes == number)
        sizes = np.bincount(pieces.ravel())
        for piece in np.flatnonzero(sizes < SCATTERED * classes.size):
            own = pieces == piece
            scattered |= own & (piece > 0 and _measure_width(own) < LEAST_WIDTH * len(classes))
    return scattered


def find_growth(classes: Int[Array, "m m"], chosen: list[int]) -> Bool[Array, "m m"]:
    """Cells of classes that are nowhere wide and together dense, as the flowers of a meadow: texture of a material."""
    others = [number for number in range(int(classes.max()) + 1) if number not in chosen]
    fine = [number for number in others if _measure_width(classes == number) < FINE * len(classes)]
    growth = np.isin(classes, fine)
    return growth if growth.mean() > objects.DENSE else np.zeros_like(growth)


def _measure_width(cells: Bool[Array, "m m"]) -> float:
    """Diameter in cells of the widest disc that lies in a region."""
    return 2 * float(distance_transform_edt(np.pad(cells, 1)).max())


def choose_materials(
    classes: Int[Array, "m m"], colour: Float[Array, "m m 3"], contrast: Float[Array, "m m"]
) -> list[int]:
    """Numbers of the classes that are materials, ascending; classes are numbered by descending share.

    contrast: of the grain around each cell.
    """
    m, chosen = len(classes), []
    for number in range(int(classes.max()) + 1):
        own = classes == number
        if own.mean() < LEAST_SHARE or _measure_width(own) < LEAST_WIDTH * m:
            continue
        light, grain = linear_light(colour[own]), contrast[own].mean()
        smoother = [other for other in chosen if grain < MORE_GRAIN * contrast[classes == other].mean()]
        if not any(is_shade(light, linear_light(colour[classes == other])) for other in smoother):
            chosen.append(number)
    return chosen[:MAX_MATERIALS] or [0]


def linear_light(colour: Float[Array, "n 3"]) -> Float[Array, "3"]:
    """Mean linear light of sRGB colours."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4).mean(0)


def is_shade(light: Float[Array, "3"], other: Float[Array, "3"]) -> bool:
    """Whether ground of this light may be the other in shade: darker in all channels, and bluer, as the sky is."""
    ratio = light / np.maximum(other, 1e-6)
    return bool(ratio.max() < SHADE and ratio[2] >= BLUER * ratio[0] and ratio[1] >= ratio[0])
