"""Masks: which pixels of the photos must not become ground.

Masks are files named as the photos, the photos' own alpha, and the empty black borders that undistorted photos have.
The fit finds objects that move between photos without masks.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array
from scipy import ndimage

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.lenses import ASPECT, undistort_photo
from dav_gswt.photos.sfm.registration import Registration, undistort_pixels

HALF = 0.5  # brightness or alpha from which a pixel counts
MARGIN = 2  # pixels around what is masked that do not count either: its blurred edge
BLACK = 8 / 255  # brightest channel of an empty border, after JPEG
BORDER_SIDE = 512  # pixels along the longer side at which empty borders are looked for
LEAST_BORDER = 0.002  # of a picture
FEWEST, LOOKED_AT = 3, 8  # photos of one size that must agree on their border, and how many of them are looked at

Size = tuple[int, int]


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
