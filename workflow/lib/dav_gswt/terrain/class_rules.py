"""Rules of classes from the config: ranges of height and slope, pictures, and the noise of the bundle."""

import hashlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray as Array

from dav_gswt.bundle.land_cover import ImageTerm, NoiseTerm, RangeTerm
from dav_gswt.bundle.manifest import TileSetInfo
from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain.classes import LATTICE, Classes

_log = logging.getLogger(__name__)

M = TypeVar("M", bound=TileSetInfo)
Picture = UInt8[Array, "rows columns"]
NOISE = ({"kind": "noise", "weight": 1.0},)  # the config's default: the noise of the bundle alone
WINDOW, SAMPLES = 64, 20_000  # tiles from the origin, and places there, in which a material is looked for
MAX_SIDE = 4096  # pixels along a side of a picture of materials
NEAR = 60.0  # of 255: largest distance of a pixel's colour from that of its material
UNKNOWN = 255  # a pixel of no material


def apply_rule(manifest: M, rule: Sequence[dict[str, Any]]) -> tuple[M, dict[str, Picture]]:
    """The manifest with the config's rule in the place of its own noise, and the pixels of the rule's pictures by file.

    A bundle of one material has no classes: the rule changes nothing, which a warning says.
    Raises: InputError: a material that is not there, a picture that cannot be read, is too large or shows none of the
        materials.
    """
    if manifest.classes is None:
        warn_of_rule(rule)
        return manifest, {}
    names = {material.name: number for number, material in enumerate(manifest.materials)}
    noise = next((term for term in manifest.classes.rule if isinstance(term, NoiseTerm)), None)
    terms, pictures = [], {}
    for entry in rule:
        if entry["kind"] == "noise":
            if noise is None:
                raise InputError("classes: the bundle has no noise of its own; make the bundle again")
            terms.append(replace(noise, weight=float(entry.get("weight", 1.0))))
        elif entry["kind"] == "image":
            term, pixels = _read_picture(entry, names, f"classes{len(pictures)}.bin")
            terms.append(term)
            pictures[term.file] = pixels
        else:
            terms.append(_make_range(entry, names, manifest.tile_side))
    return replace(manifest, classes=replace(manifest.classes, rule=terms)), pictures


def warn_of_missing(classes: Classes, names: Sequence[str]) -> None:
    """Log a warning for each material that has no place within WINDOW tiles of the origin, and those that have."""
    points = np.random.default_rng(0).integers(-WINDOW * LATTICE, WINDOW * LATTICE, (2, SAMPLES))
    best = classes.lattice_scores(*points).argmax(1)
    shares = np.bincount(best, minlength=len(names)) / SAMPLES
    for name in np.array(names)[shares == 0].tolist():
        left = ", ".join(f"{name} {share:.0%}" for name, share in zip(names, shares, strict=True) if share)
        _log.warning("classes: the rule leaves %s without any place (the ground is %s); change its terms", name, left)


def warn_of_rule(rule: Sequence[dict[str, Any]]) -> None:
    """Log a warning if a rule is given for a terrain of one material."""
    if any(entry["kind"] != "noise" for entry in rule):
        _log.warning("classes: the terrain has one material; the rule changes nothing")


def _make_range(entry: dict[str, Any], names: Mapping[str, int], side: float) -> RangeTerm:
    """Heights of the config are in tile sides, slopes are rise over run."""
    unit = side if entry["kind"] == "height" else 1.0
    low, high = (None if entry.get(key) is None else float(entry[key]) * unit for key in ("low", "high"))
    material = _find_material(entry["material"], names)
    return RangeTerm(entry["kind"], float(entry.get("weight", 1.0)), material, low, high, float(entry["soft"]) * unit)


def _find_material(name: str, names: Mapping[str, int]) -> int:
    if name not in names:
        raise InputError(f"classes: there is no material {name!r}; the terrain has {', '.join(names)}")
    return names[name]


def _read_picture(entry: dict[str, Any], names: Mapping[str, int], file: str) -> tuple[ImageTerm, Picture]:
    """A picture's pixels as numbers of materials: the nearest of the given colours; UNKNOWN if none is near."""
    path = entry["file"]
    columns, rows = image_files.read_size(path)
    if max(rows, columns) > MAX_SIDE:
        raise InputError(f"{path}: {columns} x {rows} pixels; at most {MAX_SIDE} a side: shrink the picture")
    image = image_files.read_photo(path)
    rows, columns = image.shape[:2]  # upright
    numbers = [_find_material(name, names) for name in entry["colours"]]
    colours = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in entry["colours"].values()], float)
    pixels = np.full((rows, columns), UNKNOWN, np.uint8)
    for row in range(rows):  # row by row, so that distances to all colours take little memory
        away = np.linalg.norm(255.0 * image[row, :, None, :3] - colours, axis=-1)
        known = away.min(1) <= NEAR
        pixels[row, known] = np.array(numbers, np.uint8)[away.argmin(1)[known]]
    unknown = float((pixels == UNKNOWN).mean())
    if unknown == 1:
        raise InputError(f"{path}: no pixel has the colour of a material ({', '.join(entry['colours'].values())})")
    if unknown:
        _log.warning("%s: %.1f %% of the pixels have the colour of no material", path, 100 * unknown)
    data = pixels.tobytes()
    term = ImageTerm(
        "image",
        float(entry.get("weight", 1.0)),
        file,
        len(data),
        hashlib.sha256(data).hexdigest(),
        rows,
        columns,
        float(entry["width"]),
        entry.get("beyond", "mirror"),
    )
    return term, pixels
