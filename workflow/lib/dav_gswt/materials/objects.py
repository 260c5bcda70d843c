"""Objects: single things within a material that differ from the ground around them, within a closed outline.

Dense growth is texture, not objects: where much of a material is covered, nothing is taken out of it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.ndimage import binary_closing, binary_fill_holes, binary_opening, find_objects, gaussian_filter, label

from dav_gswt.materials.maps import GroundMaps

AROUND = 1 / 10  # of the side: blur that gives the ground around a thing
ROUNDS = 3  # of the estimate of that ground, each without what stood out in the last
SURE, LIKELY = 6.0, 3.5  # robust standard deviations from the ground around: of an object's core, and of its rim
NOTICEABLE = 4.0  # weighed CIELAB units that such a deviation has at least: even ground has little spread
SMALLEST = 1 / 45  # of the side: smaller things are texture
LARGEST = 0.22  # of the side: larger things are ground that is not tiled
BORDER = 2  # cells: nearer to the border of the exemplar a thing may be cut off
MIN_FILL = 0.35  # of its bounding box that an object fills
MAX_STRETCH = 3.5  # length over width
DENSE = 0.25  # of a material that is covered by things: then they are texture


@dataclass(frozen=True)
class Footprint:
    """An object from above: its cells (rows, columns), and the material around it."""

    cells: Bool[Array, "m m"]
    material: int

    @property
    def size(self) -> tuple[int, int]:
        """Height and width of the bounding box, in cells."""
        rows, columns = find_objects(self.cells.astype(int))[0]
        return rows.stop - rows.start, columns.stop - columns.start


def find_outliers(features: Float[Array, "m m k"], maps: GroundMaps, ground: Bool[Array, "m m"]) -> Bool[Array, "m m"]:
    """Cells of a material that stand out of the ground around them by colour or by height.

    ground: the material's cells. The ground around is a blur over the cells that do not stand out.
    """
    from skimage.filters import apply_hysteresis_threshold  # here, not above: it takes half a second to load

    m, spacing = maps.cells, maps.exemplar.spacing
    relief = maps.height / spacing  # cells
    values = np.concatenate([features, relief[..., None]], -1)
    least = np.array([NOTICEABLE] * features.shape[-1] + [1.0]) / SURE
    plain = ground & maps.known
    score = np.zeros(ground.shape)
    for _ in range(ROUNDS):
        if plain.sum() < 0.1 * ground.sum():
            break
        weight = gaussian_filter(plain.astype(float), AROUND * m, mode="nearest")
        layers = [np.where(plain, layer, 0) for layer in np.moveaxis(values, -1, 0)]
        mean = np.stack([gaussian_filter(layer, AROUND * m, mode="nearest") for layer in layers], -1)
        away = values - mean / np.maximum(weight, 1e-6)[..., None]
        spread = np.maximum(1.4826 * np.median(np.abs(away[plain]), 0), least)
        score = np.abs(away / spread).max(-1)
        plain = ground & maps.known & (score < LIKELY)
    return apply_hysteresis_threshold(np.where(ground, score, 0), LIKELY, SURE)


def find_footprints(
    candidates: Bool[Array, "m m"], materials: Int[Array, "m m"], known: Bool[Array, "m m"]
) -> tuple[list[Footprint], Bool[Array, "m m"]]:
    """Objects among the cells that stand out, and the cells of everything else that is no texture.

    materials: the nearest material of every cell. Things at the border of the exemplar are cut off, so they are no
    objects; nor are things that are long, frayed or large. Returns: footprints; cells to be filled beside them.
    """
    m = len(candidates)
    things, number = label(_clean(candidates), np.ones((3, 3)))
    footprints, excluded = [], ~known
    for k, box in enumerate(find_objects(things), 1):
        own = things == k
        sides = sorted(part.stop - part.start for part in box)
        if sides[1] < SMALLEST * m:
            continue
        whole = min(part.start for part in box) >= BORDER and max(part.stop for part in box) <= m - BORDER
        compact = sides[1] <= MAX_STRETCH * sides[0] and own.sum() >= MIN_FILL * sides[0] * sides[1]
        if whole and compact and sides[1] <= LARGEST * m and known[own].all():
            footprints.append(Footprint(own, int(np.bincount(materials[own]).argmax())))
        else:
            excluded = excluded | own
    return footprints, excluded


def _clean(cells: Bool[Array, "m m"]) -> Bool[Array, "m m"]:
    """Without threads and specks, and without holes."""
    return binary_fill_holes(binary_closing(binary_opening(cells, np.ones((2, 2), bool)), np.ones((3, 3), bool)))


def is_dense(things: Bool[Array, "m m"], ground: Bool[Array, "m m"]) -> bool:
    """Whether so much of a material is covered that the things are its texture."""
    return bool(ground.any() and things[ground].mean() > DENSE)
