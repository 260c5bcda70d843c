"""The photos stage for scenes that come from files: photos with or without a camera model, or a finished field."""

import logging
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import minimum_filter

from dav_gswt.errors import InputError
from dav_gswt.field import write_field
from dav_gswt.files import atomic_folder
from dav_gswt.geometry.scene_frame import LeftOutPhoto, SceneFrame, write_scene_frame
from dav_gswt.images import image_files
from dav_gswt.images.file_kinds import detect_kind
from dav_gswt.logs import progress
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.ground_frame import fit_ground_frame
from dav_gswt.photos.importers import import_model, splat
from dav_gswt.photos.importers.splat_files import read_splat
from dav_gswt.photos.lenses import ASPECT, Lens, pinhole_parameters, undistort_photo, write_lenses
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos, undistort_image
from dav_gswt.threads import map_ahead

_log = logging.getLogger(__name__)

HALF = 0.5  # brightness from which a mask's pixel counts
MARGIN = 2  # pixels around what is masked that do not count either: its blurred edge


def prepare_photos(
    source: Path | str,
    out: Path | str,
    options: SfmOptions,
    given: Path | str | None = None,
    masks: Path | str | None = None,
) -> SceneFrame:
    """Register the photos in `source`, and write undistorted pictures, model and ground.json into the folder `out`.

    given: a camera model of another program, used as it is. masks: a folder, see `undistort_masks`.
    Returns what ground.json holds.
    Raises: InputError: see `register_photos`, `import_model`, `undistort_masks` and `fit_ground_frame`.
    """
    found = import_model(given, source, options) if given else register_photos(source, options)
    about = found.positions.about if found.positions else None
    model, frame = fit_ground_frame(found.model, np.random.default_rng(options.seed), about)
    frame = replace(
        frame,
        images=len(model.names) + len(found.left_out),
        registered=len(model.names),
        left_out=tuple(LeftOutPhoto(name, reason) for name, reason in found.left_out),
        focal_ratio=found.focal.ratio if found.focal else None,
        focal=found.focal,
        reprojection_error=found.error,
        points=len(model.points),
        verdict=found.verdict,
    )
    numbers = progress(range(len(model.names)), "undistort photos")
    pictures = zip(model.names, map_ahead(partial(undistort_image, found), numbers, options.threads), strict=True)
    covers = undistort_masks(found, masks) if masks else {}
    write_photo_folder(out, model, pictures, frame, _list_lenses(found), covers)
    return frame


def write_photo_folder(
    path: Path | str,
    model: ColmapModel,
    pictures: Iterable[tuple[str, Float[Array, "h w 3"]]],
    frame: SceneFrame,
    lenses: Sequence[Lens] = (),
    covers: Mapping[str, Float32[Array, "h w"]] | None = None,
) -> None:
    """Write images/, sparse/, lenses.json and ground.json into the folder `path`, which is replaced.

    pictures: by file name. covers: masks by the pictures' names, 0 where a pixel does not count;
    they become alpha.
    """
    with atomic_folder(path) as part:
        (part / "images").mkdir()
        for name, image in pictures:
            cover = covers.get(name) if covers else None
            image_files.write_png(part / "images" / name, image if cover is None else np.dstack([image, cover]))
        (part / "sparse").mkdir()
        write_colmap_model(model, part / "sparse")
        if lenses:
            write_lenses(part, lenses)
        write_scene_frame(part / "ground.json", frame)


def undistort_masks(found: Registration, folder: Path | str) -> dict[str, Float32[Array, "h w"]]:
    """Masks of a registration's pictures, by name: 1 where a picture counts, 0 where it does not.

    Masks are pictures named as their photos, black where the photo must not become ground, such as
    on cars, people or the photographer's shadow. The fit finds objects that move between photos
    without masks.
    Raises: InputError: no folder, a mask of another shape than its photo, or none that belongs to a
    photo.
    """
    listed = {path.stem: path for path in image_files.list_photos(folder)}
    covers = {}
    for i, (name, source) in enumerate(zip(found.model.names, found.sources, strict=True)):
        path = listed.get(source.stem) or listed.get(source.name)  # as COLMAP names them: photo.jpg.png
        if path is None:
            continue
        mask, (width, height) = image_files.read_photo(path), image_files.read_size(source)
        if abs(mask.shape[1] * height / (mask.shape[0] * width) - 1) > ASPECT:
            raise InputError(f"{path}: is {mask.shape[1]} x {mask.shape[0]}, its photo {width} x {height}; same shape")
        lens = found.lenses[i]
        rows = (np.arange(lens.height) + 0.5) * mask.shape[0] // lens.height
        columns = (np.arange(lens.width) + 0.5) * mask.shape[1] // lens.width
        there = mask[rows.astype(int)][:, columns.astype(int)].mean(-1, keepdims=True) >= HALF
        seen = undistort_photo(np.repeat(there.astype(np.float32), 3, axis=2), lens, found.model.cameras[i])[..., 0]
        covers[name] = minimum_filter((seen > HALF).astype(np.float32), 2 * MARGIN + 1)
    if not covers:
        raise InputError(f"{folder}: no mask is named like a photo; name each as its photo, as IMG_1.png for IMG_1.jpg")
    _log.info("masks: %d of %d photos have one", len(covers), len(found.model.names))
    return covers


def _list_lenses(found: Registration) -> list[Lens]:
    """The lenses of a registration, the one of most pictures first."""
    pairs = [(pinhole_parameters(c), lens) for c, lens in zip(found.model.cameras, found.lenses, strict=True)]
    order = [pinhole for pinhole, _ in Counter(pinhole for pinhole, _ in pairs).most_common()]
    return [Lens(next(lens for p, lens in pairs if p == pinhole), pinhole) for pinhole in order]


def import_field(
    source: Path | str,
    out: Path | str,
    ground: Path | str,
    up: Sequence | None = None,
    crop: Sequence | None = None,
    seed: int = 0,
) -> SceneFrame:
    """Bring a finished splat into its ground frame: the field to `out`, ground.json to `ground`.

    up: a rough direction upwards in the file; None: the side on which things stand. crop: lowest and highest corner of
    the scene in the file; None: its dense part. Raises: InputError: see `read_splat` and `fit_field_frame`.
    """
    given = read_splat(source)
    if given.sh_degree > 0:
        splat.report_dropped_harmonics(given.sh_degree)
    usual = splat.UP_OF_SPZ if detect_kind(Path(source)) == "spz" else splat.UP
    try:
        entered, frame = splat.fit_field_frame(given.field, np.random.default_rng(seed), up, crop, given.origin, usual)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    write_field(entered, out)
    write_scene_frame(ground, frame)
    return frame
