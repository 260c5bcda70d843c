"""The photos stage as one call for each kind of scene that comes from files."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.field import read_field, write_field
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.photos import folder, ground_frame, importers, lenses
from dav_gswt.photos import masks as masking
from dav_gswt.photos.importers import splat
from dav_gswt.photos.lenses import Lens
from dav_gswt.photos.sfm import registration
from dav_gswt.photos.sfm.registration import Options


def from_photos(
    source: Path | str,
    out: Path | str,
    options: Options,
    given: Path | str | None = None,
    masks: Path | str | None = None,
    extra: dict | None = None,
) -> dict:
    """Register the photos in `source`, and write undistorted pictures, model and ground.json into the folder `out`.

    given: a model of another program, taken as it is. masks: a folder, see `masks`. extra: more for ground.json (where
    it comes from). Returns what ground.json holds.
    Raises: InputError: see sfm.register, imported.read, masks.read and ground.frame.
    """
    found = importers.read(given, source, options) if given else registration.register(source, options)
    model, facts = ground_frame.frame(found.model, np.random.default_rng(options.seed), found.positions)
    left_out = [{"name": name, "reason": reason} for name, reason in found.left_out]
    facts = {
        "kind": "photos",
        **facts,
        "test": None,
        "images": len(model.names) + len(left_out),
        "registered": len(model.names),
        "left_out": left_out,
        "focal_ratio": found.focal_ratio,
        "focal": asdict(found.focal) if found.focal else None,
        "reprojection_error": found.error,
        "points": len(model.points),
        **(extra or {}),
    }
    numbers = progress(range(len(model.names)), "undistort photos")
    pictures = ((model.names[i], registration.undistorted(found, i)) for i in numbers)
    covers = masking.undistorted(found, masks) if masks else {}
    folder.write(out, model, pictures, facts, lenses_of(found), covers)
    return facts


def lenses_of(found: registration.Registered) -> list[Lens]:
    """The lenses of a registration, that of most pictures first."""
    pairs = [(lenses.pinhole(c), lens) for c, lens in zip(found.model.cameras, found.lenses, strict=True)]
    order = [pinhole for pinhole, _ in Counter(pinhole for pinhole, _ in pairs).most_common()]
    return [Lens(next(lens for p, lens in pairs if p == pinhole), pinhole) for pinhole in order]


def from_field(
    source: Path | str,
    out: Path | str,
    frame: Path | str,
    up: Sequence = splat.UP,
    seed: int = 0,
    extra: dict | None = None,
) -> dict:
    """Bring a finished 3DGS .ply into its ground frame: the field to `out`, ground.json to `frame`.

    up: a direction that points roughly upwards in the file. Raises: InputError: see read_field and splat.enter.
    """
    given = read_field(source)
    try:
        entered, facts = splat.enter(given, np.random.default_rng(seed), up)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    facts |= {"images": 0, "registered": 0, "left_out": [], "focal_ratio": None} | (extra or {})
    write_field(entered, out)
    write_json(frame, facts)
    return facts
