"""views.json: the split of a scene's photos into start views, candidates and test views."""

import logging
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.files import read_record, write_json
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame

if TYPE_CHECKING:
    from dav_gswt.photos.colmap_model import ColmapModel  # loads pycolmap

_log = logging.getLogger(__name__)

TEST_SHARE = 0.1  # of the photos
LEAST_WITH_TEST = 12  # photos, below which none is spared for testing unless asked for
ENOUGH = 10  # photos that show the exemplar: with fewer, the others take part, too
LEAST_START = 2  # photos that must be left beside those that test
MIN_VISIBLE_SHARE = 0.05  # of the ground that an image must see, or
MIN_PICTURE_SHARE = 0.5  # so much of its picture must show that ground, which may be wider than many pictures
LINK = 30  # points that a start view shares with one chosen before: enough to fix its place among them

Bounds = tuple[float, float, float, float]  # west, south, east, north


@dataclass(frozen=True)
class ViewSplit:
    """Names of images. start: for the first fit. pool: candidates of a replay. test: for evaluation alone."""

    start: tuple[str, ...]
    pool: tuple[str, ...]
    test: tuple[str, ...]


def write_view_split(path: Path | str, split: ViewSplit) -> None:
    """Write views.json."""
    write_json(path, asdict(split))


def read_view_split(path: Path | str) -> ViewSplit:
    """Read views.json. Raises: InputError: not readable, or not lists of names."""
    return read_record(path, ViewSplit, "make it again")


def split_views(
    model: "ColmapModel",
    frame: SceneFrame,
    rng: np.random.Generator,
    start: int | None = None,
    test: int | None = None,
    whole: bool = False,
) -> ViewSplit:
    """Names of the start views, the pool and the test views.

    start: photos of the first fit; None: all that are left. test: photos to set aside; None: one in ten, and none of
    fewer than LEAST_WITH_TEST. whole: all ground counts, not only the exemplar.

    Images that show too little of the exemplar, or with `whole` of all ground, take no part unless
    too few would remain. Test views are those that ground.json names, else the same for every seed.
    `start` of the others start, if there are so many.
    Raises: InputError: ground.json names a test view that is no image, or too few are left to start from.
    """
    if unknown := [name for name in frame.test or () if name not in model.names]:
        raise InputError(f"ground.json: test view {unknown[0]} is not among the images")
    part = frame.extent if whole else frame.exemplar
    ground = (part.west, part.south, part.east, part.north)
    sees = [i for i, camera in enumerate(model.cameras) if shows_enough(camera, ground)]
    enough = len(sees) >= min((start or ENOUGH) + 2, ENOUGH)
    among = sees if enough else list(range(len(model.names)))
    if frame.test is None:
        tests = choose_test_views(model, ground, among, test)
    else:
        tests = [model.names.index(name) for name in frame.test]
    others = [i for i in among if i not in tests]
    if not others:
        raise InputError("every image is a test view; leave some to start from")
    if len(among) < len(model.names):
        few = "%d of %d photos show little of the ground that counts, and take no part"
        _log.warning(few, len(model.names) - len(among), len(model.names))
    first = choose_start_views(model, others, start or len(others), rng)
    pool = [i for i in others if i not in first]
    return ViewSplit(*(tuple(model.names[i] for i in part) for part in (first, pool, tests)))


def choose_test_views(model: "ColmapModel", ground: Bounds, among: list[int], count: int | None = None) -> list[int]:
    """Test views that are spread over the inner half of the ground (by area), if enough images look there.

    count: of them; None: one image in ten, none of fewer than LEAST_WITH_TEST.

    At the border few other images see the same ground, so a test there would measure the border.
    The first view looks nearest to the middle, each next one is the farthest from those before.
    Raises: InputError: more than can be spared.
    """
    if count is None:
        count = round(TEST_SHARE * len(among)) if len(among) >= LEAST_WITH_TEST else 0
    if not count:
        return []
    if count > len(among) - LEAST_START:
        raise InputError(f"test: {count} of {len(among)} photos cannot be set aside: {LEAST_START} must be left to fit")
    low, high = np.reshape(ground, (2, 2))
    aims = np.stack([find_aim_point(camera) for camera in model.cameras])
    off = (np.abs(aims - (low + high) / 2) / (high - low)).max(1)
    inner = [i for i in among if off[i] <= 0.5 * 0.5**0.5]
    if len(inner) < 2 * count:
        inner = sorted(among, key=lambda i: off[i])[: 2 * count]
    chosen = [min(inner, key=lambda i: off[i])]
    while len(chosen) < count:
        chosen.append(_find_farthest(aims, [i for i in inner if i not in chosen], chosen))
    return sorted(chosen)


def choose_start_views(model: "ColmapModel", among: list[int], count: int, rng: np.random.Generator) -> list[int]:
    """A connected, spread set of images: a random first, then always the one farthest from those
    chosen.

    Images that share at least LINK points with a chosen one are considered; if there is none, those
    that share most. Distances are between the positions of the cameras.
    """
    from dav_gswt.photos.colmap_model import count_shared_points  # not above: it loads pycolmap

    shared = count_shared_points(model)
    centres = np.stack([camera.centre for camera in model.cameras])
    linked = [i for i in among if (shared[i, [j for j in among if j != i]] >= LINK).any()]
    chosen = [int(rng.choice(linked or among))]
    while len(chosen) < min(count, len(among)):
        left = [i for i in among if i not in chosen]
        link = shared[np.ix_(left, chosen)].max(1)
        near = [i for i, points in zip(left, link, strict=True) if points >= LINK]
        if not near:
            near = [i for i, points in zip(left, link, strict=True) if points == link.max()]
            _log.warning("start view %s shares only %d points with the others", model.names[near[0]], link.max())
        chosen.append(_find_farthest(centres, near, chosen))
    return chosen


def shows_enough(camera: Camera, ground: Bounds) -> bool:
    """Whether a picture shows enough of the ground, or the ground fills enough of the picture."""
    return (
        measure_visible_share(camera, ground) >= MIN_VISIBLE_SHARE
        or measure_picture_share(camera, ground) >= MIN_PICTURE_SHARE
    )


def measure_picture_share(camera: Camera, ground: Bounds, grid: int = 16) -> float:
    """The share of a picture that shows the plane z = 0 between these bounds."""
    return float(find_ground_pixels(camera.resized(grid, grid), ground).mean())


def find_ground_pixels(camera: Camera, ground: Bounds) -> Bool[Array, "h w"]:
    """Whether the ray of each pixel meets the plane z = 0 between these bounds."""
    west, south, east, north = ground
    origin, step = camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -origin[..., 2] / step[..., 2]
        x, y = origin[..., 0] + t * step[..., 0], origin[..., 1] + t * step[..., 1]
    return (t > 0) & (x > west) & (x < east) & (y > south) & (y < north)


def measure_visible_share(camera: Camera, ground: Bounds, grid: int = 16) -> float:
    """The share of the ground between these bounds that a camera sees."""
    (west, south, east, north), at = ground, (np.arange(grid) + 0.5) / grid
    x, y = np.meshgrid(west + at * (east - west), south + at * (north - south))
    pixels, depth = camera.project(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1))
    inside = (pixels > 0).all(1) & (pixels[:, 0] < camera.width) & (pixels[:, 1] < camera.height)
    return float((inside & (depth > 0)).mean())


def find_aim_point(camera: Camera) -> Float[Array, "2"]:
    """Where the middle of a picture looks on the plane z = 0; below the camera if it looks to the sky."""
    forward, centre = camera.forward, camera.centre
    if forward[2] > -0.1:
        return centre[:2]
    return centre[:2] - centre[2] / forward[2] * forward[:2]


def _find_farthest(places: Float[Array, "n d"], among: list[int], chosen: list[int]) -> int:
    apart = np.linalg.norm(places[among][:, None] - places[chosen][None], axis=2).min(1)
    return int(among[int(apart.argmax())])
