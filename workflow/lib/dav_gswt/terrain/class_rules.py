"""Rules of classes from the config: ranges of height and slope, the noise of the bundle, painted places."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from dav_gswt.bundle.land_cover import NoiseTerm, ObjectEntry, RangeTerm, find_run_fault
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.files import locate_path, read_record
from dav_gswt.terrain.classes import LATTICE, Classes

_log = logging.getLogger(__name__)

NOISE = ({"kind": "noise", "weight": 1.0},)  # the config's default: the noise of the bundle alone
WINDOW, SAMPLES = 64, 20_000  # tiles from the origin, and places there, in which a material is looked for
MAX_BYTES = 2**24  # of a painted file
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


def apply_rule(manifest: Manifest, rule: Sequence[dict[str, Any]]) -> Manifest:
    """The manifest with the config's rule in the place of its own noise.

    A bundle of one material has no classes: the rule changes nothing, which a warning says; densities of objects that
    were set on the page count nevertheless.
    Raises: InputError: a material that is not there; two painted files, or nothing but one; see also `read_paint`.
    """
    names = [material.name for material in manifest.materials]
    files, paint = [entry["file"] for entry in rule if entry["kind"] == "painted"], None
    if files:
        if len(files) > 1 or len(rule) == 1:
            raise InputError("classes: `painted` takes one file, beside other terms such as {kind: noise}")
        paint = read_paint(locate_path(files[0]), names)
        if manifest.objects and manifest.scatter:
            objects = scale_objects(manifest.objects, manifest.scatter.cells, paint)
            manifest = replace(manifest, objects=objects)
    rule = [entry for entry in rule if entry["kind"] != "painted"]
    if manifest.classes is None:
        if any(entry["kind"] != "noise" for entry in rule):
            _log.warning("classes: the terrain has one material; the rule changes nothing")
        return manifest
    noise = next((term for term in manifest.classes.rule if isinstance(term, NoiseTerm)), None)
    if noise and paint:
        offsets = [paint.offsets.get(name, 0.0) for name in names]
        noise = replace(noise, biases=[bias + offset for bias, offset in zip(noise.biases, offsets, strict=True)])
    terms = []
    for entry in rule:
        kind, weight = entry["kind"], float(entry.get("weight", 1.0))
        if kind == "noise":
            if noise is None:
                raise InputError("classes: the bundle has no noise of its own; make the bundle again")
            terms.append(replace(noise, weight=weight))
        else:  # heights of the config are in tile sides, slopes are rise over run
            unit, material = manifest.tile_side if kind == "height" else 1.0, _find_material(entry["material"], names)
            low, high = (None if entry.get(key) is None else float(entry[key]) * unit for key in ("low", "high"))
            terms.append(RangeTerm(kind, weight, material, low, high, float(entry["soft"]) * unit))
    classes = replace(manifest.classes, rule=terms, painted=paint.runs if paint else manifest.classes.painted)
    return replace(manifest, classes=classes)


def warn_of_missing(classes: Classes, names: Sequence[str]) -> None:
    """Log a warning for each material that has no place within WINDOW tiles of the origin, and those that have."""
    points = np.random.default_rng(0).integers(-WINDOW * LATTICE, WINDOW * LATTICE, (2, SAMPLES))
    best = classes.lattice_scores(*points).argmax(1)
    shares = np.bincount(best, minlength=len(names)) / SAMPLES
    for name in np.array(names)[shares == 0].tolist():
        left = ", ".join(f"{name} {share:.0%}" for name, share in zip(names, shares, strict=True) if share)
        _log.warning("classes: the rule leaves %s without any place (the ground is %s); change its terms", name, left)


def _find_material(name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise InputError(f"classes: there is no material {name!r}; the terrain has {', '.join(names)}")
    return names.index(name)


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
    painted = [paint.materials[run[3]] for run in paint.runs]
    if strange := set(painted) - set(names):
        raise InputError(f"{path}: there is no material {min(strange)!r}; the terrain has {', '.join(names)}")
    runs = [[*run[:3], names.index(name)] for run, name in zip(paint.runs, painted, strict=True)]
    return replace(paint, materials=list(names), runs=runs)


def scale_objects(objects: Sequence[ObjectEntry], cells: int, paint: PaintFile) -> list[ObjectEntry]:
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
