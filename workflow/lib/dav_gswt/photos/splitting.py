"""The split of a scene's photos into start views, candidates and test views."""

import logging

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.colmap_model import ColmapModel, count_shared_points
from dav_gswt.photos.view_split import LEAST_TEST, LEAST_WITH_TEST, ViewSplit, count_tests

_log = logging.getLogger(__name__)

MIN_VISIBLE_SHARE = 0.05  # of the ground in question that an image must see,
MIN_PICTURE_SHARE = 0.5  # or so much of its picture must show that ground, which may be wider than many pictures
LINK = 30  # points that a start view shares with one chosen before: enough to fix its place among them


Bounds = tuple[float, float, float, float]  # west, south, east, north


def split_views(
    model: ColmapModel, frame: SceneFrame, start: int, rng: np.random.Generator, whole: bool = False
) -> ViewSplit:
    """Names of the start views, the pool and the test views.

    whole: all ground that the photos see is in question, not the exemplar alone.
    Only images that see at least MIN_VISIBLE_SHARE of it, or little else, take part: others show ground that no tile is
    made of. Where too few would remain, all take part.
    Test views are those that ground.json names; where it names none, about one photo in ten, at least two, spread over
    the ground in question: the same whatever the seed. Start views are `start` others, or as many as there are.
    Raises: InputError: ground.json names a test view that is no image, or no view is left to start from.
    """
    given = _read_test_names(model, frame)
    ground = ground_bounds(frame, whole)
    sees = [i for i, camera in enumerate(model.cameras) if shows_enough(camera, ground)]
    enough = len(sees) >= min(start, LEAST_WITH_TEST + LEAST_TEST) + LEAST_TEST
    among = sees if enough else list(range(len(model.names)))
    test = given if given is not None else choose_test_views(model, ground, among)
    others = [i for i in among if i not in test]
    if not others:
        raise InputError("every image is a test view; leave some to start from")
    if len(among) < len(model.names):
        _log.info("%d of %d images see enough of the ground in question to take part", len(among), len(model.names))
    first = choose_start_views(model, others, start, rng)
    pool = [i for i in others if i not in first]
    return ViewSplit(*(tuple(model.names[i] for i in part) for part in (first, pool, test)))


def choose_test_views(model: ColmapModel, ground: Bounds, among: list[int]) -> list[int]:
    """About one image in ten, at least two, spread and over the ground; none of fewer than LEAST_WITH_TEST.

    Only images that look at the inner half of the ground (by area) are considered, if there are enough: at the border
    few others see the same ground, and what a test there measures is the border. The first is the one that looks
    nearest to the middle, each next one the farthest from those before.
    """
    if not (count := count_tests(len(among))):
        return []
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


def choose_start_views(model: ColmapModel, among: list[int], count: int, rng: np.random.Generator) -> list[int]:
    """A connected, spread set of images: a random first, then again and again the one farthest from those chosen.

    Considered are images that share at least LINK points with one chosen; where there is none, those that share most.
    Distances are between the positions of the cameras.
    """
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


def ground_bounds(frame: SceneFrame, whole: bool) -> Bounds:
    """The exemplar, or all ground that the photos see."""
    if whole:
        extent = frame.extent
        return extent.west, extent.south, extent.east, extent.north
    square = frame.exemplar
    return square.west, square.south, square.east, square.north


def shows_enough(camera: Camera, ground: Bounds) -> bool:
    """Whether a picture shows enough of the ground, or the ground fills enough of the picture."""
    if measure_visible_share(camera, ground) >= MIN_VISIBLE_SHARE:
        return True
    return measure_picture_share(camera, ground) >= MIN_PICTURE_SHARE


def measure_picture_share(camera: Camera, ground: Bounds, grid: int = 16) -> float:
    """The share of a picture that shows the plane z = 0 between these bounds."""
    west, south, east, north = ground
    at = (np.arange(grid) + 0.5) / grid
    x, y = np.meshgrid((at * camera.width - camera.cx) / camera.fx, (at * camera.height - camera.cy) / camera.fy)
    rays = np.stack([x.ravel(), y.ravel(), np.ones(x.size)], 1) @ camera.rotation
    falls = rays[:, 2] * camera.centre[2] < 0
    hits = camera.centre[:2] - rays[:, :2] * (camera.centre[2] / np.where(falls, rays[:, 2], 1.0))[:, None]
    inside = (hits > [west, south]).all(1) & (hits < [east, north]).all(1)
    return float((inside & falls).mean())


def measure_visible_share(camera: Camera, ground: Bounds, grid: int = 16) -> float:
    """The share of the ground between these bounds that a camera sees."""
    (west, south, east, north), at = ground, (np.arange(grid) + 0.5) / grid
    x, y = np.meshgrid(west + at * (east - west), south + at * (north - south))
    pixels, depth = camera.project(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], 1))
    inside = (pixels > 0).all(1) & (pixels[:, 0] < camera.width) & (pixels[:, 1] < camera.height)
    return float((inside & (depth > 0)).mean())


def find_aim_point(camera: Camera) -> Float[Array, "2"]:
    """Where the middle of a picture looks on the plane z = 0; under the camera where it looks to the sky."""
    forward, centre = camera.forward, camera.centre
    if forward[2] > -0.1:
        return centre[:2]
    return centre[:2] - centre[2] / forward[2] * forward[:2]


def _find_farthest(places: Float[Array, "n d"], among: list[int], chosen: list[int]) -> int:
    apart = np.linalg.norm(places[among][:, None] - places[chosen][None], axis=2).min(1)
    return int(among[int(apart.argmax())])


def _read_test_names(model: ColmapModel, frame: SceneFrame) -> list[int] | None:
    if frame.test is None:
        return None
    if unknown := [name for name in frame.test if name not in model.names]:
        raise InputError(f"ground.json: test view {unknown[0]} is not among the images")
    return [model.names.index(name) for name in frame.test]
