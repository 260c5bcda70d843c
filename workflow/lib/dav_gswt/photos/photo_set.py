"""The photos stage for scenes that come from files: photos with or without a camera model, or a finished field."""

import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

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
from dav_gswt.photos.lenses import Lens, pinhole_parameters, write_lenses
from dav_gswt.photos.masks import PhotoMasks, find_borders, read_picture
from dav_gswt.photos.photo_files import find_sun
from dav_gswt.photos.photo_listing import Source, list_photos
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos
from dav_gswt.threads import map_ahead

_log = logging.getLogger(__name__)


def prepare_photos(
    source: Source,
    out: Path | str,
    options: SfmOptions,
    given: Path | str | None = None,
    masks: Path | str | None = None,
) -> SceneFrame:
    """Register the photos in `source`, and write undistorted pictures, model and ground.json into the folder `out`.

    given: a camera model of another program, used as it is. masks: a folder of them, black where a photo must not
    become ground, such as on cars, people or the photographer's shadow; else those that `list_photos` finds.
    Masks become the pictures' alpha. Returns what ground.json holds.
    Raises: InputError: see `list_photos`, `register_photos`, `import_model`, `read_picture` and `fit_ground_frame`, or
    a folder of masks has none that belongs to a photo.
    """
    covers = list_photos(source, masks).masks
    if masks and not covers:
        raise InputError(f"{masks}: no mask is named like a photo; name each as its photo, as IMG_1.png for IMG_1.jpg")
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
        sun=find_sun(found.sources, frame.georeference) if frame.georeference else None,
    )
    known = PhotoMasks(covers, find_borders(found.sources))
    numbers, masked = progress(range(len(model.names)), "undistort photos"), Counter[str]()

    def read_pictures() -> Iterator[tuple[str, Float[Array, "h w c"]]]:
        read = map_ahead(partial(read_picture, found, known), numbers, options.threads)
        for name, (picture, masked_by) in zip(model.names, read, strict=True):
            masked.update(masked_by)
            yield name, picture

    write_photo_folder(out, model, read_pictures(), frame, _list_lenses(found))
    if masked:
        ways = ", ".join(f"{by} ({count} of {len(model.names)} photos)" for by, count in masked.items())
        _log.info("masks: %s; what they hide is no ground", ways)
    return frame


def write_photo_folder(
    path: Path | str,
    model: ColmapModel,
    pictures: Iterable[tuple[str, Float[Array, "h w c"]]],
    frame: SceneFrame,
    lenses: Sequence[Lens] = (),
) -> None:
    """Write images/, sparse/, lenses.json and ground.json into the folder `path`, which is replaced.

    pictures: by file name; a fourth channel is their mask, 0 where a pixel does not count.
    """
    with atomic_folder(path) as part:
        (part / "images").mkdir()
        for name, image in pictures:
            image_files.write_png(part / "images" / name, image)
        (part / "sparse").mkdir()
        write_colmap_model(model, part / "sparse")
        if lenses:
            write_lenses(part, lenses)
        write_scene_frame(part / "ground.json", frame)


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
        text = "view-dependent colour (degree %d) is dropped: the colour from all sides is kept"
        _log.warning(text, given.sh_degree)
    usual = splat.UP_OF_SPZ if detect_kind(Path(source)) == "spz" else splat.UP
    try:
        entered, frame = splat.fit_field_frame(given.field, np.random.default_rng(seed), up, crop, given.origin, usual)
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    write_field(entered, out)
    write_scene_frame(ground, frame)
    return frame
