"""Fit the scatter of objects to their measured densities."""

import logging

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.bundle.chunks import ChunkOrders
from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.land_cover import ClassesEntry, ObjectOrders, ScatterEntry
from dav_gswt.materials.model import ObjectLevels
from dav_gswt.terrain.classes import Classes
from dav_gswt.terrain.scatter import Scatter

_log = logging.getLogger(__name__)

TURN, SIZE = 15.0, 0.15  # largest turn in degrees, since sunlight is part of the colours, and change of size
CANDIDATES = 3.0  # a wanted object
MAX_CELLS = 64  # along a tile's side
WANTED, MAX_WINDOW = 600.0, 96  # objects that a probability is measured with; tiles along a side of the window
PASSES = 5
SHORTFALL = 0.9  # share of the wanted density below which a warning is logged


def fit_scatter(content: BundleContent, classes: ClassesEntry | None, salt: int) -> tuple[ScatterEntry, list[float]]:
    """The scatter grid, and the probability of each object with which it has its density, losses included.

    Candidates are lost to others that overlap them and to borders of materials. They are counted in a window of the
    terrain, and the probabilities are corrected by what is missing. A density that does not fit is reported.
    """
    densities = np.array([each.density for each in content.objects])
    material = np.array([each.material for each in content.objects])
    fullest = max(densities[material == m].sum() for m in range(len(content.materials)))
    cells = int(np.clip(np.ceil(content.side * np.sqrt(CANDIDATES * fullest)), 1, MAX_CELLS))
    entry = ScatterEntry(cells, TURN, SIZE, salt)
    cover = classes and Classes(classes, len(content.materials), content.side)
    probabilities = _cap(densities * (content.side / cells) ** 2, material)
    reached = densities
    for _ in range(PASSES):
        scatter = Scatter(entry, _describe(content.objects, probabilities), content.side, cover)
        reached = measure_densities(scatter, content)
        probabilities = _cap(probabilities * np.clip(densities / np.maximum(reached, 1e-300), 0.5, 2), material)
    for each, density in zip(content.objects, reached.tolist(), strict=True):
        if density < SHORTFALL * each.density:
            _log.warning(
                "objects: %s stands %.3g times per unit of area where %.3g were found; there is no room for more",
                each.name,
                density,
                each.density,
            )
    return entry, probabilities.tolist()


def measure_densities(scatter: Scatter, content: BundleContent) -> Float[Array, "objects"]:
    """Number of each object per unit of area of its material, in a window about the origin."""
    shares = np.array([content.materials[each.material].share for each in content.objects])
    densities = np.array([each.density for each in content.objects])
    rarest = float((densities * shares)[densities > 0].min(initial=np.inf)) * content.side**2
    window = int(np.clip(np.ceil(np.sqrt(WANTED / rarest)), 8, MAX_WINDOW))
    i, j = (v.ravel() for v in np.mgrid[:window, :window].astype(np.int64) - window // 2)
    found = scatter.instances_in(i, j)
    counts = np.bincount(found.number, minlength=len(content.objects))
    return counts / (window**2 * content.side**2 * shares)


def _describe(objects: list[ObjectLevels], probabilities: Float[Array, "objects"]) -> list[ObjectOrders]:
    none: list[ChunkOrders] = []
    return [
        ObjectOrders(each.name, each.radius, [0.0, 0.0], 0.0, each.material, each.density, float(p), none)
        for each, p in zip(objects, probabilities, strict=True)
    ]


def _cap(probabilities: Float[Array, "objects"], material: Array) -> Float[Array, "objects"]:
    """Probabilities of which those of one material's objects sum to 1 at most."""
    sums = np.bincount(material, probabilities)[material]
    return probabilities / np.maximum(sums, 1)
