"""Which cells of an exemplar belong to which material, which to an object, and which are not tiled at all."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from dav_gswt.materials import objects, segmentation, shading, standing
from dav_gswt.materials.maps import NO_CLASS, GroundMaps, GroundMasks, Surroundings, find_wide_parts, unite
from dav_gswt.materials.objects import Footprint, is_shade, linear_light

MAX_MATERIALS = 4
LEAST_SHARE = 0.05  # of the exemplar, of a material
LEAST_WIDTH = 0.13  # of its side: a disc so wide lies in a material
WOOD = 0.24  # of its side: growth so wide without plain ground is no texture, as the crowns of a wood
WOODED = 0.2  # of all growth, that is so wide at least
CROWNS = 0.16  # of its side: beside a wood growth so wide is no texture either
RIM = 1 / 128  # of the side: width of the blurred rim of shade and of other excluded ground
HALO = 2 * segmentation.GRAIN  # of the side, from the ground: so far reaches the grain's contrast of a thing
LITTLE = 0.02  # of the exemplar: so little that stands out of one rough material is left in it
ROUGH = 0.5  # cells that blobs usually rise by, from which ground is dense with growth or stones
MORE_GRAIN = 1.6  # times a material's contrast: rougher ground is no shade of it (that under trees is dappled)
SCATTERED = 0.03  # of the exemplar: a smaller and narrow piece of a material, within another, is a thing on that


@dataclass(frozen=True)
class GroundClasses:
    """The classes of an exemplar's cells.

    Attributes:
        materials: of every cell, by number; cells of objects and of excluded ground have the nearest
            cell's.
        footprints: the objects.
        excluded: cells that are shown nowhere: shade, what is rare or cut off, ground that no photo saw.
        kinds: what every cell is: its material's number, also of small pieces within another material,
            which are excluded there; from `number` on each strip (a path, a road).
        names: of the materials.
        sun: in which the ground lay; None: not known.
    """

    materials: Int[Array, "m m"]
    kinds: Int[Array, "m m"]
    footprints: list[Footprint]
    excluded: Bool[Array, "m m"]
    names: list[str]
    sun: shading.Sun | None = None

    @property
    def number(self) -> int:
        """How many materials there are."""
        return len(self.names)

    @property
    def occupied(self) -> Bool[Array, "m m"]:
        """Cells of objects."""
        return unite([each.cells for each in self.footprints], self.materials.shape)

    def source(self, material: int) -> Bool[Array, "m m"]:
        """Cells that a material is made of."""
        return (self.materials == material) & ~self.excluded & ~self.occupied

    @property
    def shares(self) -> Float[Array, "k"]:
        """Of all ground that is not excluded, by material; they sum to 1."""
        count = np.bincount(self.materials[~self.excluded], minlength=self.number)
        return count / max(count.sum(), 1)


def classify_ground(
    maps: GroundMaps, masks: GroundMasks | None = None, relief: Bool[Array, "m m"] | None = None
) -> GroundClasses:
    """Find materials and objects.

    A class is a material if it is wide somewhere, common enough, and not the shade of another; at most
    MAX_MATERIALS are kept, the largest. If no class is one, all of the ground is one material. Other
    cells are objects or excluded ground.
    masks: drawn by people. Materials that they name are taken as they are, and the rest is excluded.
    relief: what stands or is sunk: excluded, and it makes no class common or wide.
    """
    sun = None if masks and masks.materials else shading.fit_sun(maps)  # shade that is named is kept
    if sun and sun.explained >= shading.LEAST_EXPLAINED:
        maps = shading.even_light(maps, sun)
    relief = np.zeros_like(maps.known) if relief is None else relief
    features = segmentation.describe_cells(maps.colour)
    if masks and masks.materials:
        classes, names = masks.label()
        ground = _LabelledGround(classes, list(range(len(names))), names, np.zeros(classes.shape, bool), [])
    else:
        ground = _segment_ground(maps, features[..., -1], relief)
    known = maps.known & (ground.classes != NO_CLASS)
    maps = replace(maps, known=known & ~masks.excluded if masks else known)
    around = _describe_surroundings(maps, features[..., :3], ground)
    tall = standing.find_standing_things(around, maps)
    footprints, excluded = objects.find_footprints(tall, _find_outstanding(maps, around), around)
    kinds = np.where(ground.pieces, np.searchsorted(ground.chosen, np.maximum(ground.classes, 0)), around.materials)
    for place, strip in enumerate(ground.strips):
        kinds[strip] = len(ground.chosen) + place
    taken = unite([each.cells for each in footprints], known.shape) | excluded | around.strips
    if masks is None and around.rough == {0} and len(ground.chosen) == 1 and taken.mean() < LITTLE:
        return GroundClasses(around.materials, kinds, [], ~maps.known | relief, ground.names, sun)
    wide = _widen(excluded & maps.known | around.strips | relief, footprints) | ~maps.known
    return GroundClasses(around.materials, kinds, footprints, wide, ground.names, sun)


@dataclass(frozen=True)
class _LabelledGround:
    """Classes of all cells (or NO_CLASS), those that are materials, their small pieces within others, and strips."""

    classes: Int[Array, "m m"]
    chosen: list[int]
    names: list[str]
    pieces: Bool[Array, "m m"]
    strips: list[Bool[Array, "m m"]]


def _segment_ground(maps: GroundMaps, contrast: Float[Array, "m m"], relief: Bool[Array, "m m"]) -> _LabelledGround:
    """Ground by its looks: the segmentation with the most materials, since a start of k-means may hide one in another.

    contrast: of the grain around each cell. relief: see `classify_ground`.
    """
    found = []
    for classes, strips in segmentation.list_segmentations(maps.colour):
        apart = np.where(unite([*strips, relief], classes.shape), NO_CLASS, classes)
        found.append((classes, strips, choose_materials(apart, maps.colour, contrast)))
    classes, strips, chosen = max(found, key=lambda each: len(each[-1]))  # of several the first: it explains most
    names = [f"material{k}" for k in range(len(chosen))]
    return _LabelledGround(classes, chosen, names, find_scattered(classes, chosen), strips)


def _describe_surroundings(maps: GroundMaps, features: Float[Array, "m m 3"], ground: _LabelledGround) -> Surroundings:
    classes, chosen = ground.classes, ground.chosen
    crossing = unite(ground.strips, classes.shape)
    wide = np.isin(classes, chosen) & maps.known & ~ground.pieces & ~crossing
    nearest = tuple(distance_transform_edt(~wide, return_distances=False, return_indices=True))
    materials = np.searchsorted(chosen, classes[nearest])
    wide |= find_growth(np.where(crossing, NO_CLASS, classes), chosen) & maps.known
    wide |= _find_halos(features, wide, materials) & maps.known & ~ground.pieces & ~crossing
    rise = standing.measure_rise(maps)
    rough = frozenset(
        k for k in range(len(chosen)) if standing.measure_roughness(rise, wide & (materials == k)) > ROUGH
    )
    return Surroundings(maps.colour, features, rise, materials, wide, ground.pieces, crossing, maps.known, rough)


def _find_halos(
    features: Float[Array, "m m 3"], ground: Bool[Array, "m m"], materials: Int[Array, "m m"]
) -> Bool[Array, "m m"]:
    """Cells that are of another class only by the contrast of a thing beside them: near ground of their own colour."""
    near = distance_transform_edt(~ground) <= HALO * len(ground)
    found = np.zeros_like(ground)
    for number in np.unique(materials[ground]):
        own = materials == number
        found |= own & near & ~ground & (objects.measure_deviation(features, own & ground) < objects.LIKELY)
    return found


def _widen(excluded: Bool[Array, "m m"], footprints: list[Footprint]) -> Bool[Array, "m m"]:
    """Excluded ground with its blurred rim, off the objects."""
    if not excluded.any():
        return excluded
    wide = binary_dilation(excluded, iterations=max(1, round(RIM * len(excluded))))
    return wide & ~unite([each.cells for each in footprints], excluded.shape) | excluded


def _find_outstanding(maps: GroundMaps, around: Surroundings) -> Bool[Array, "m m"]:
    """Cells that are no ground of a material, or stand out of a smooth one that is not dense with such cells."""
    things = ~around.ground & maps.known & ~around.strips
    for number in np.unique(around.materials):
        own = around.materials == number
        found = things & own
        if number not in around.rough:
            found |= objects.find_outliers(around.features, maps, own & around.ground)
        things = things & ~own | found
        if (found & around.ground)[own].mean() > objects.DENSE:  # then they are its texture
            things = things & ~(own & around.ground)
    return things


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
    """Cells of classes that are nowhere wide and together dense, as the flowers of a meadow: texture of a material.

    Where much of them lies together without plain ground between, as the crowns of a wood do, that is
    no texture; but on ground where no material is wide, all classes are texture.
    """
    m = len(classes)
    widths = {number: _measure_width(classes == number) for number in range(int(classes.max()) + 1)}
    narrow = [number for number, width in widths.items() if width < LEAST_WIDTH * m and number not in chosen]
    growth = np.isin(classes, narrow)
    wooded = find_wide_parts(growth, WOOD * m).sum() > WOODED * growth.sum()
    if wooded and max(widths[number] for number in chosen) >= LEAST_WIDTH * m:
        growth &= ~find_wide_parts(growth, CROWNS * m)
    return growth if growth.mean() > objects.DENSE else np.zeros_like(growth)


def _measure_width(cells: Bool[Array, "m m"]) -> float:
    """Diameter in cells of the widest disc that lies in a region."""
    return 2 * float(distance_transform_edt(np.pad(cells, 1)).max())


def choose_materials(
    classes: Int[Array, "m m"], colour: Float[Array, "m m 3"], contrast: Float[Array, "m m"]
) -> list[int]:
    """Numbers of the classes that are materials, ascending.

    classes: by descending share; NO_CLASS for cells of strips. contrast: of the grain around each cell.
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
