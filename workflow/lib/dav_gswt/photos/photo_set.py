"""The photos stage for scenes that come from files: photos with or without a camera model, or a finished field."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.field import read_field, write_field
from dav_gswt.geometry.scene_frame import LeftOutPhoto, SceneFrame, write_scene_frame
from dav_gswt.logs import progress
from dav_gswt.photos.folder import write_photo_folder
from dav_gswt.photos.ground_frame import fit_ground_frame
from dav_gswt.photos.importers import import_model, splat
from dav_gswt.photos.importers.splat import fit_field_frame
from dav_gswt.photos.lenses import Lens, pinhole_parameters
from dav_gswt.photos.masks import undistort_masks
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos, undistort_image
from dav_gswt.threads import map_ahead


def prepare_photos(
    source: Path | str,
    out: Path | str,
    options: SfmOptions,
    given: Path | str | None = None,
    masks: Path | str | None = None,
) -> SceneFrame:
    """Register the photos in `source`, and write undistorted pictures, model and ground.json into the folder `out`.

    given: a model of another program, taken as it is. masks: a folder, see `masks`. Returns what ground.json holds.
    Raises: InputError: see `register_photos`, `import_model`, `undistort_masks` and `fit_ground_frame`.
    """
    found = import_model(given, source, options) if given else register_photos(source, options)
    model, frame = fit_ground_frame(found.model, np.random.default_rng(options.seed), found.positions)
    frame = replace(
        frame,
        images=len(model.names) + len(found.left_out),
        registered=len(model.names),
        left_out=tuple(LeftOutPhoto(name, reason) for name, reason in found.left_out),
        focal_ratio=found.focal_ratio,
        focal=found.focal,
        reprojection_error=found.error,
        points=len(model.points),
        verdict=found.verdict,
    )
    numbers = progress(range(len(model.names)), "undistort photos")
    pictures = zip(model.names, map_ahead(partial(undistort_image, found), numbers, options.threads), strict=True)
    covers = undistort_masks(found, masks) if masks else {}
    write_photo_folder(out, model, pictures, frame, list_lenses(found), covers)
    return frame


def list_lenses(found: Registration) -> list[Lens]:
    """The lenses of a registration, that of most pictures first."""
    pairs = [(pinhole_parameters(c), lens) for c, lens in zip(found.model.cameras, found.lenses, strict=True)]
    order = [pinhole for pinhole, _ in Counter(pinhole for pinhole, _ in pairs).most_common()]
    return [Lens(next(lens for p, lens in pairs if p == pinhole), pinhole) for pinhole in order]


def import_field(
    source: Path | str,
    out: Path | str,
    ground: Path | str,
    up: Sequence = splat.UP,
    seed: int = 0,
) -> SceneFrame:
    """Bring a finished 3DGS .ply into its ground frame: the field to `out`, ground.json to `ground`.

    up: a direction that points roughly upwards in the file. Raises: InputError: see `read_field` and `fit_field_frame`.
    """
    given = read_field(source)
    try:
        entered, frame = fit_field_frame(given, np.random.default_rng(seed), up)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    write_field(entered, out)
    write_scene_frame(ground, frame)
    return frame
