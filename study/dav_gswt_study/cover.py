"""The picture of the README: some photos in a row, and below them the terrain that was made of them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.files import atomic_file
from dav_gswt.images import image_files

WIDTH, PHOTOS, GAP = 1280, 8, 4  # pixels; photos in the row; pixels between pictures
ASPECT = 4 / 3  # of a photo, cut to it about its middle
QUALITY = 85


def draw_cover(photos: Sequence[Path | str], still: Path | str, out: Path | str) -> None:
    """Write the picture as a JPEG. Photos beyond PHOTOS are left out; fewer are wider."""
    from matplotlib.image import imsave  # here, not above: it takes a second to load

    row = arrange_photos([image_files.read_photo(path) for path in photos[:PHOTOS]])
    terrain = image_files.read_photo(still)
    below = image_files.shrink_image(terrain, WIDTH, round(WIDTH * terrain.shape[0] / terrain.shape[1]))
    picture = np.concatenate([row, np.ones((GAP, WIDTH, 3)), below])
    with atomic_file(out) as part:
        imsave(part, np.clip(picture, 0, 1), format="jpg", pil_kwargs={"quality": QUALITY})


def arrange_photos(photos: Sequence[Float[Array, "_ _ 3"]]) -> Float[Array, "h w 3"]:
    """Photos side by side, WIDTH pixels in all. Raises: ValueError: there is none."""
    if not photos:
        raise ValueError("no photos to show")
    edges = np.rint(np.linspace(0, WIDTH + GAP, len(photos) + 1)).astype(int)
    widths = np.diff(edges) - GAP
    height = round(int(widths.min()) / ASPECT)
    row = np.ones((height, WIDTH, 3))
    for photo, left, width in zip(photos, edges[:-1], widths, strict=True):
        row[:, left : left + width] = crop_and_shrink(photo, int(width), height)
    return row


def crop_and_shrink(photo: Float[Array, "_ _ 3"], width: int, height: int) -> Float[Array, "h w 3"]:
    """The middle of a photo at the shape of width x height pixels."""
    rows, columns = photo.shape[:2]
    wide = min(columns, max(width, int(rows * width / height)))
    tall = min(rows, max(height, int(columns * height / width)))
    top, left = (rows - tall) // 2, (columns - wide) // 2
    middle = photo[top : top + tall, left : left + wide]
    times = max(1, -(-width // middle.shape[1]), -(-height // middle.shape[0]))  # small photos: pixels become blocks
    large = np.ascontiguousarray(middle.repeat(times, 0).repeat(times, 1), np.float32)
    return image_files.shrink_image(large, width, height)
