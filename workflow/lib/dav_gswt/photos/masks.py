"""Masks: parts of photos that must not become ground, such as cars, people, targets or the photographer's shadow.

A folder of pictures named as their photos (any suffix that is read), white where the photo counts and black where it
does not. Ground that is masked in every photo is filled from around it and marked as uncertain; tiles avoid it where
they can. Objects that move between photos need no mask: the fit finds them.
"""

import logging
from pathlib import Path

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array
from scipy.ndimage import minimum_filter

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.photos.lenses import undistort_photo

_log = logging.getLogger(__name__)

HALF = 0.5  # brightness from which a mask's pixel counts
MARGIN = 2  # pixels around what is masked that do not count either: its blurred edge
ASPECT = 0.01  # a mask whose sides differ more from its photo's is of another photo


def undistort_masks(found, folder: Path | str) -> dict[str, Float32[Array, "h w"]]:
    """Masks of a registration's pictures, by name: 1 where a picture counts, 0 where it does not.

    found: a `Registration`. Raises: InputError: no folder, a mask of another shape than its photo, or none that
    belongs to a photo.
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
        covers[name] = _warp_mask(mask, found.lenses[i], found.model.cameras[i])
    if not covers:
        raise InputError(f"{folder}: no mask is named like a photo; name each as its photo, as IMG_1.png for IMG_1.jpg")
    _log.info("masks: %d of %d photos have one", len(covers), len(found.model.names))
    return covers


def _warp_mask(mask, lens, camera) -> Float32[Array, "h w"]:
    """A mask as the pinhole camera would see it."""
    rows = (np.arange(lens.height) + 0.5) * mask.shape[0] // lens.height
    columns = (np.arange(lens.width) + 0.5) * mask.shape[1] // lens.width
    there = (mask[rows.astype(int)][:, columns.astype(int)].mean(-1, keepdims=True) >= HALF).astype(np.float32)
    seen = undistort_photo(np.repeat(there, 3, axis=2), lens, camera)[..., 0]
    return minimum_filter((seen > HALF).astype(np.float32), 2 * MARGIN + 1)
