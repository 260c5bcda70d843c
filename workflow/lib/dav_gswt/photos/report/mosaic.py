"""The exemplar as the photos show it from above, before anything is fitted, and the kinds of ground in it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import figures, image_files
from dav_gswt.photos.report.facts import ReportFacts
from dav_gswt.photos.splitting import ground_bounds, measure_visible_share

CELLS = 192  # along a side of the exemplar
PHOTOS = 12  # at most, those that look at the exemplar from most nearly above
STEEP = 8  # power of the cosine of the angle off straight down that a photo's weight is
COMMON = 0.05  # of the exemplar: rarer kinds of ground are not listed
TINT = 0.4  # weight of a kind's colour
LONGEST = 1024  # pixels of a photo's longer side


Segment = Callable[[Float[Array, "m m 3"]], Int[Array, "m m"]]


@dataclass(frozen=True)
class GroundKinds:
    """Kinds of ground. shares: of the exemplar, of those that are common. picture: as it is, and with their colours."""

    shares: tuple[float, ...]
    picture: Float[Array, "h w 3"]


def find_kinds(folder: Path, found: ReportFacts, segment: Segment) -> GroundKinds | None:
    """Kinds of ground by their looks alone; None where no photo looks down at the exemplar.

    segment: labels of the cells of a picture by descending share, from 0.
    """
    mosaic = make_mosaic(folder, found)
    if mosaic is None:
        return None
    labels = segment(mosaic)
    shares = np.bincount(labels.ravel()) / labels.size
    coloured = (1 - TINT) * mosaic + TINT * np.array(figures.KINDS)[labels % len(figures.KINDS)]
    pair = np.concatenate([mosaic, np.ones((len(mosaic), 4, 3)), coloured], 1)[::-1]
    return GroundKinds(tuple(float(share) for share in shares if share >= COMMON), pair)


def make_mosaic(folder: Path, found: ReportFacts) -> Float[Array, "m m 3"] | None:
    """Colours of the plane z = 0 over the exemplar, sRGB, the southern row first; the steepest photos count most.

    Cells that none of these photos sees have the mean colour. None: no photo sees any.
    """
    west, south, east, north = ground_bounds(found.frame, whole=False)
    at = (np.arange(CELLS) + 0.5) / CELLS
    x, y = np.meshgrid(west + at * (east - west), south + at * (north - south))
    places = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1)
    total, weight = np.zeros((len(places), 3)), np.zeros(len(places))
    for name, camera in choose_steep_views(found):
        image, cover = image_files.read_photo_and_alpha(folder / name)
        colour, seen = sample_photo(image, cover, camera, places)
        down = camera.centre - places
        steep = np.where(seen, np.clip(down[:, 2] / np.linalg.norm(down, axis=1), 0, 1) ** STEEP, 0)
        total += steep[:, None] * colour
        weight += steep
    if not (weight > 0).any():
        return None
    mean = total.sum(0) / weight.sum()
    colours = np.where(weight[:, None] > 0, total / np.maximum(weight, 1e-12)[:, None], mean)
    return colours.reshape(CELLS, CELLS, 3)


def choose_steep_views(found: ReportFacts) -> list[tuple[str, Camera]]:
    """Names and cameras of the photos that show most of the exemplar most steeply."""
    bounds = ground_bounds(found.frame, whole=False)
    pairs = list(zip(found.model.names, found.model.cameras, strict=True))
    worth = [
        measure_visible_share(camera, bounds) * max(-float(camera.forward[2]), 0.0) ** STEEP for _, camera in pairs
    ]
    order = sorted((i for i in range(len(pairs)) if worth[i] > 0), key=lambda i: -worth[i])
    return [pairs[i] for i in order[:PHOTOS]]


def sample_photo(
    image: Float[Array, "h w 3"], cover: Float[Array, "h w"], camera: Camera, places: Float[Array, "n 3"]
) -> tuple[Float[Array, "n 3"], Bool[Array, "n"]]:
    """The photo's colours of places, and which of them it shows unmasked. cover: 0 where it is masked."""
    small, unmasked = image_files.shrink_to(image, LONGEST), image_files.shrink_to(cover[..., None], LONGEST)[..., 0]
    height, width = unmasked.shape
    pixels, depth = camera.resized(width, height).project(places)
    inside = (depth > 0) & (pixels >= 0).all(1) & (pixels[:, 0] < width) & (pixels[:, 1] < height)
    column, row = np.where(inside[:, None], pixels, 0).astype(int).T
    return small[row, column], inside & (unmasked[row, column] > 0.99)
