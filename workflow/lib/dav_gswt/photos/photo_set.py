"""The photos stage for scenes that come from files: photos with or without a camera model, or a finished field.

Masks say which pixels of the photos must not become ground: files named as the photos, the photos' own alpha, and the
empty black borders that undistorted photos have. The fit finds objects that move between photos without masks.
"""

import logging
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy import ndimage

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
from dav_gswt.photos.photo_files import find_sun
from dav_gswt.photos.photo_listing import Source, list_photos
from dav_gswt.photos.sfm.registration import Registration, SfmOptions, register_photos, undistort_pixels
from dav_gswt.threads import map_ahead

HALF = 0.5  # brightness or alpha from which a pixel counts
MARGIN = 2  # pixels around what is masked that do not count either: its blurred edge
BLACK = 8 / 255  # brightest channel of an empty border, after JPEG
BORDER_SIDE = 512  # pixels along the longer side at which empty borders are looked for
LEAST_BORDER = 0.002  # of a picture
FEWEST, LOOKED_AT = 3, 8  # photos of one size that must agree on their border, and how many of them are looked at

Size = tuple[int, int]
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class PhotoMasks:
    """What is known of the photos' masks. files: by photo. borders: by the photos' size, where their picture is."""

    files: Mapping[Path, Path]
    borders: Mapping[Size, Bool[Array, "_ _"]]


def find_borders(sources: Sequence[Path]) -> dict[Size, Bool[Array, "_ _"]]:
    """False where all photos of a size are black from the border inwards, as undistorted photos are beside their
    picture; True elsewhere. Sizes whose photos fill their frame are left out.
    """
    sizes = defaultdict[Size, list[Path]](list)
    for path in sources:
        sizes[image_files.read_size(path)].append(path)
    out = {}
    for (width, height), paths in sizes.items():
        if len(paths) < FEWEST:
            continue
        empty, step = (
            np.ones(image_files.fit_size(width, height, BORDER_SIDE)[::-1], bool),
            max(1, len(paths) // LOOKED_AT),
        )
        for path in paths[::step][:LOOKED_AT]:
            empty &= find_black_border(image_files.shrink_to(image_files.read_photo(path), BORDER_SIDE))
            if empty.mean() < LEAST_BORDER:  # nearly always after the first photo
                break
        else:
            out[width, height] = ndimage.minimum_filter(~empty, 3)
    return out


def find_black_border(picture: Float32[Array, "h w 3"]) -> Bool[Array, "h w"]:
    """The black pixels that hang together with the picture's edge."""
    parts, _ = ndimage.label(picture.max(-1) <= BLACK)
    edge = np.unique(np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]]))
    return np.isin(parts, edge[edge > 0])


def read_picture(found: Registration, masks: PhotoMasks, index: int) -> tuple[Float32[Array, "h w c"], tuple[str, ...]]:
    """The undistorted picture of the model's image `index`, and what masks it.

    Where something does, the fourth channel is 0 where the picture must not become ground, and 1 elsewhere.
    Raises: InputError: a mask of another shape than its photo.
    """
    source, lens = found.sources[index], found.lenses[index]
    photo, alpha = image_files.read_photo_and_alpha(source)
    size = photo.shape[1], photo.shape[0]
    covers = {"their alpha": alpha >= HALF} if (alpha < HALF).any() else {}
    if source in masks.files:
        covers["files"] = read_mask(masks.files[source], size)
    if size in masks.borders:
        covers["black borders"] = masks.borders[size]
    picture = undistort_pixels(found, index, photo)
    if not covers:
        return picture, ()
    there = np.logical_and.reduce([_sample(cover, lens.width, lens.height) for cover in covers.values()])
    flat = np.repeat(there[..., None].astype(np.float32), 3, axis=2)
    seen = undistort_photo(flat, lens, found.model.cameras[index])[..., 0] > HALF
    return np.dstack([picture, ndimage.minimum_filter(seen.astype(np.float32), 2 * MARGIN + 1)]), tuple(covers)


def read_mask(path: Path, size: Size) -> Bool[Array, "_ _"]:
    """Where a mask is bright. size: width and height of its photo. Raises: InputError: it is of another shape."""
    mask, (width, height) = image_files.read_photo(path), size
    if abs(mask.shape[1] * height / (mask.shape[0] * width) - 1) > ASPECT:
        raise InputError(f"{path}: is {mask.shape[1]} x {mask.shape[0]}, its photo {width} x {height}; same shape")
    return mask.mean(-1) >= HALF


def _sample(mask: Bool[Array, "_ _"], width: int, height: int) -> Bool[Array, "height width"]:
    """A mask at another size: the nearest of its pixels."""
    rows = (np.arange(height) + 0.5) * mask.shape[0] // height
    columns = (np.arange(width) + 0.5) * mask.shape[1] // width
    return mask[rows.astype(int)][:, columns.astype(int)]


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
