"""Files of painted materials, as the page saves them."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from dav_gswt.bundle.land_cover import ObjectOrders, find_run_fault
from dav_gswt.errors import InputError
from dav_gswt.files import read_record

_log = logging.getLogger(__name__)

MAX_BYTES = 2**24  # of a file
MAX_DENSITY, MAX_OFFSET = 3.0, 8.0
MAX_CANDIDATES = 512  # objects on a tile that the page draws
REMEDY = "save it on the page again"


@dataclass(frozen=True)
class PaintFile:
    """What a person painted and set.

    Attributes:
        format, version: of the file.
        materials: names, by the numbers of the runs.
        runs: [I, J, length, material] of painted points of the lattice of scores, from (I, J) to the east.
        densities: by name of an object, how many times as densely it stands; 1 where it is not named.
        offsets: by name of a material, what is added to the biases of the rule's noise; 0 where it is not named.
    """

    format: Literal["davgswt-paint"]
    version: Literal[1]
    materials: list[str]
    runs: list[list[int]]
    densities: dict[str, float] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)


def read_paint(path: Path | str, names: Sequence[str]) -> PaintFile:
    """A file of painted materials, with the numbers and names of a terrain's materials.

    Raises: InputError: missing, malformed or too large, out of bounds, or painted with materials that are not there.
    """
    if Path(path).is_file() and Path(path).stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: more than {MAX_BYTES} bytes; {REMEDY}")
    paint = read_record(path, PaintFile, REMEDY)
    if fault := find_run_fault(paint.runs, len(paint.materials)):
        raise InputError(f"{path}: runs: {fault}; {REMEDY}")
    if not all(0 <= v <= MAX_DENSITY for v in paint.densities.values()):
        raise InputError(f"{path}: densities: beyond 0 to {MAX_DENSITY:g}; {REMEDY}")
    if not all(abs(v) <= MAX_OFFSET for v in paint.offsets.values()):
        raise InputError(f"{path}: offsets: beyond {MAX_OFFSET:g} either way; {REMEDY}")
    numbers = [names.index(name) if name in names else -1 for name in paint.materials]
    for material in sorted({run[3] for run in paint.runs}):
        if numbers[material] < 0:
            raise InputError(
                f"{path}: there is no material {paint.materials[material]!r}; the terrain has {', '.join(names)}"
            )
    runs = [[i, j, length, numbers[material]] for i, j, length, material in paint.runs]
    return replace(paint, materials=list(names), runs=runs)


def scale_objects(objects: Sequence[ObjectOrders], cells: int, paint: PaintFile) -> list[ObjectOrders]:
    """Objects with the probabilities of a paint's densities: those of one material sum to 1 at most, and no more stand
    on a tile than the page draws. A density of an object that is not there is told in a warning.

    Args:   cells: of the scatter along a tile's side.
    """
    if strange := sorted(set(paint.densities) - {each.name for each in objects}):
        _log.warning("classes: the painted file has densities of objects that are not there: %s", ", ".join(strange))
    scaled = np.array([each.probability * paint.densities.get(each.name, 1.0) for each in objects])
    material = np.array([each.material for each in objects])
    scaled = scaled / np.maximum(np.bincount(material, scaled)[material], 1)
    scaled = scaled / max(1.0, cells**2 * float(scaled.sum()) / MAX_CANDIDATES)
    return [replace(each, probability=float(p)) for each, p in zip(objects, scaled, strict=True)]
