"""A sparse model as arrays: pinhole cameras, points, and the observations of points by cameras."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pycolmap
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files

pycolmap.logging.minloglevel = 2  # it reports every step of every photo on stderr; progress is reported instead

WORST_ERROR = 4.0  # pixels: an observation farther from its point's projection is a wrong match
LEAST_ANGLE = 1.5  # degrees between two rays, below which their crossing says nothing about depth


@dataclass(frozen=True)
class ColmapModel:
    """n points seen m times by named pinhole cameras.

    colours: sRGB in [0, 1]. Observation k says that image image_of[k] sees point point_of[k] at pixels[k]; observations
    are ordered by point, then by image.
    """

    names: tuple[str, ...]
    cameras: tuple[Camera, ...]
    points: Float[Array, "n 3"]
    colours: Float32[Array, "n 3"]
    point_of: Int[Array, "m"]
    image_of: Int[Array, "m"]
    pixels: Float[Array, "m 2"]

    def camera(self, name: str) -> Camera:
        """The camera of a named image. Raises: InputError: no such image."""
        if name not in self.names:
            raise InputError(f"{name}: no such image in the model; it may not have been registered")
        return self.cameras[self.names.index(name)]


def bundle_adjust(
    stored: pycolmap.Reconstruction, refine_focal_length: bool = False, priors: Sequence[pycolmap.PosePrior] = ()
) -> None:
    """Bundle adjustment in one thread, in place.

    With `priors`, positions of cameras, whose outliers are held back, lenses stay; without, two cameras hold the
    world's frame.
    """
    options = pycolmap.BundleAdjustmentOptions(
        refine_focal_length=refine_focal_length, refine_extra_params=not priors, print_summary=False
    )
    options.ceres.solver_options.num_threads = 1
    config = pycolmap.BundleAdjustmentConfig()
    for number in stored.reg_image_ids():
        config.add_image(number)
    if priors:
        robust = pycolmap.PosePriorBundleAdjustmentOptions()
        robust.ceres.prior_position_loss_function_type = pycolmap.LossFunctionType.CAUCHY
        robust.alignment_ransac.random_seed = 0
        pycolmap.create_pose_prior_bundle_adjuster(options, robust, config, list(priors), stored).solve()
    else:
        config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
        pycolmap.create_default_bundle_adjuster(options, config, stored).solve()


def transform_model(
    model: ColmapModel, scale: float, rotation: Float[Array, "3 3"], shift: Float[Array, "3"]
) -> ColmapModel:
    """The model in another world frame: p becomes scale * rotation @ p + shift; the pictures stay as they are."""

    def moved(camera: Camera) -> Camera:
        turn = camera.rotation @ rotation.T
        return replace(camera, rotation=turn, translation=scale * camera.translation - turn @ shift)

    return replace(model, cameras=tuple(map(moved, model.cameras)), points=scale * model.points @ rotation.T + shift)


def reprojection_errors(model: ColmapModel) -> Float[Array, "m"]:
    """Distance in pixels of every observation from its point's projection; infinite behind the camera."""
    distance = np.full(len(model.pixels), np.inf)
    for i, camera in enumerate(model.cameras):
        own = np.flatnonzero(model.image_of == i)
        at, depth = camera.project(model.points[model.point_of[own]])
        distance[own] = np.where(depth > 0, np.linalg.norm(at - model.pixels[own], axis=1), np.inf)
    return distance


def count_shared_points(model: ColmapModel) -> Int[Array, "images images"]:
    """How many points each pair of images sees in common; on the diagonal, how many each sees."""
    return _count_common(model.image_of, model.point_of, len(model.names))


def group_images(model: ColmapModel, least: int) -> tuple[Int[Array, "images"], Int[Array, "groups groups"]]:
    """The groups of images that at least so many points tie together, and how many points tie each two groups.

    A point ties two groups if both see it, and three images in all: of two images that share a point, neither is given
    a scale by the other. Groups begin as single images and merge until no two have enough ties.
    """
    ties = (np.bincount(model.point_of, minlength=len(model.points)) >= 3)[model.point_of]
    group, count = np.arange(len(model.names)), -1
    while True:
        shared = _count_common(group[model.image_of[ties]], model.point_of[ties], int(group.max(initial=0)) + 1)
        found, merged = connected_components(shared >= least, directed=False)
        if found == count:
            return group, shared
        group, count = merged[group], found


def _count_common(rows: Int[Array, "m"], points: Int[Array, "m"], count: int) -> Int[Array, "count count"]:
    """How many points each pair of `count` rows has in common."""
    shape = count, points.max(initial=0) + 1
    sees = csr_array((np.ones(len(rows), np.int64), (rows, points)), shape=shape)
    sees.data[:] = 1  # a point may be seen twice in one image
    return (sees @ sees.T).toarray()


def triangulate_model(model: ColmapModel, names: Sequence[str]) -> ColmapModel:
    """The model of the named images alone, its points found anew from what these see; colours are mid-grey.

    A point is the one nearest to its rays in the sense of least squares, sum_i |(I - d_i d_i^T)(p - c_i)|^2 over ray
    directions d_i and camera centres c_i, in closed form. Points seen by one image, off by
    more than WORST_ERROR in one of them, behind one, or under rays narrower than LEAST_ANGLE are left out.
    Cameras stay: in a replay they stand for the vehicle's own positioning.
    Raises: InputError: a name that the model does not have.
    """
    if unknown := sorted(set(names) - set(model.names)):
        raise InputError(f"{unknown[0]}: no such image in the model; it may not have been registered")
    part = _with_images(model, [i for i, name in enumerate(model.names) if name in set(names)])
    part = replace(part, colours=np.full(model.points.shape, 0.5, np.float32))
    part = select_points(part, np.bincount(part.point_of, minlength=len(part.points)) >= 2)
    points, spread = intersect_rays(part)
    part = replace(part, points=points)
    return drop_wrong_points(part, spread >= 1 - np.cos(np.radians(LEAST_ANGLE)))


def drop_wrong_points(model: ColmapModel, good: Bool[Array, "n"]) -> ColmapModel:
    """The model of its good points, without those that are off by more than WORST_ERROR in an image."""
    good = good.copy()
    np.logical_and.at(good, model.point_of, reprojection_errors(model) <= WORST_ERROR)
    return select_points(model, good)


def intersect_rays(model: ColmapModel) -> tuple[Float[Array, "n 3"], Float[Array, "n"]]:
    """The points nearest to their rays, and how well the rays fix them.

    The second is the least eigenvalue of sum_i (I - d_i d_i^T): for two rays at angle a it is 1 - cos a, 0 where all
    rays are parallel, and another ray never lowers it. Centres are taken relative to their mean, against cancellation.
    """
    centres = np.stack([camera.centre for camera in model.cameras])
    middle = centres.mean(0)
    rays = np.empty((len(model.pixels), 3))
    for i, camera in enumerate(model.cameras):
        own = model.image_of == i
        seen = np.ones((np.count_nonzero(own), 3))
        seen[:, :2] = (model.pixels[own] - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
        rays[own] = seen / np.linalg.norm(seen, axis=1, keepdims=True) @ camera.rotation
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    n = len(model.points)
    matrix, side = np.zeros((n, 3, 3)), np.zeros((n, 3))
    np.add.at(matrix, model.point_of, across)
    np.add.at(side, model.point_of, np.einsum("mij,mj->mi", across, centres[model.image_of] - middle))
    spread = np.linalg.eigvalsh(matrix)[:, 0] if n else np.zeros(0)
    solvable = spread > 1e-12
    points = np.full((n, 3), np.nan)
    points[solvable] = np.linalg.solve(matrix[solvable], side[solvable][..., None])[..., 0] + middle
    return points, spread


def _with_images(model: ColmapModel, kept: list[int]) -> ColmapModel:
    """The model of some of its images; all points stay."""
    number = np.full(len(model.names), -1)
    number[kept] = np.arange(len(kept))
    own = number[model.image_of] >= 0
    return replace(
        model,
        names=tuple(model.names[i] for i in kept),
        cameras=tuple(model.cameras[i] for i in kept),
        point_of=model.point_of[own],
        image_of=number[model.image_of[own]],
        pixels=model.pixels[own],
    )


def select_points(model: ColmapModel, kept: Bool[Array, "n"]) -> ColmapModel:
    """The model of some of its points; all images stay."""
    own = kept[model.point_of]
    return replace(
        model,
        points=model.points[kept],
        colours=model.colours[kept],
        point_of=(np.cumsum(kept) - 1)[model.point_of[own]],
        image_of=model.image_of[own],
        pixels=model.pixels[own],
    )


def colour_points(model: ColmapModel, pictures: Sequence[Path]) -> Float32[Array, "n 3"]:
    """Every point's mean colour over the pixels that see it; black where none does. pictures: files of the images."""
    total = np.zeros((len(model.points), 3))
    for i, picture in enumerate(pictures):
        own = model.image_of == i
        image = image_files.read_photo(picture)
        column, row = np.clip(model.pixels[own].astype(int), 0, [image.shape[1] - 1, image.shape[0] - 1]).T
        np.add.at(total, model.point_of[own], image[row, column])
    count = np.bincount(model.point_of, minlength=len(model.points))
    return (total / np.maximum(count, 1)[:, None]).astype(np.float32)


def read_colmap_model(folder: Path | str) -> ColmapModel:
    """Read a COLMAP model of pinhole cameras, its images by name. Raises: InputError: missing, damaged, no pinhole."""
    try:
        stored = pycolmap.Reconstruction(str(folder))
    except Exception as error:  # the library raises what its C++ does, bare RuntimeErrors among it
        raise InputError(f"{folder}: not readable as a COLMAP model ({error})") from error
    for camera in stored.cameras.values():
        if camera.model_name not in ("PINHOLE", "SIMPLE_PINHOLE"):
            raise InputError(f"{folder}: its cameras are {camera.model_name}; undistort the images to PINHOLE first")
    return model_from_reconstruction(stored)


def model_from_reconstruction(
    stored: pycolmap.Reconstruction,
    pinholes: Mapping[int, pycolmap.Camera] | None = None,
) -> ColmapModel:
    """Arrays of a reconstruction, its images ordered by name.

    pinholes: by the number of a camera the undistorted one that takes its place; observations move with it.
    """
    ids = np.array(sorted(stored.points3D), np.int64)
    found = sorted((stored.images[i].name, i) for i in stored.reg_image_ids())
    cameras, rows = [], [np.zeros((0, 4))]  # of each observation its point, its image and its pixel
    for i, (_, key) in enumerate(found):
        image = stored.images[key]
        lens = stored.cameras[image.camera_id]
        target = pinholes[image.camera_id] if pinholes else lens
        pose, ((fx, _, cx), (_, fy, cy), _) = image.cam_from_world().matrix(), target.calibration_matrix().tolist()
        cameras.append(Camera(pose[:, :3].copy(), pose[:, 3].copy(), fx, fy, cx, cy, target.width, target.height))
        seen = np.array([(p.point3D_id, i, *p.xy) for p in image.get_observation_points2D()], float).reshape(-1, 4)
        if pinholes:
            seen[:, 2:] = target.img_from_cam(np.c_[lens.cam_from_img(seen[:, 2:]), np.ones(len(seen))])
        rows.append(seen)
    observed = np.concatenate(rows)
    point_of, image_of = np.searchsorted(ids, observed[:, 0].astype(np.int64)), observed[:, 1].astype(int)
    order = np.lexsort((image_of, point_of))
    points = [stored.points3D[i] for i in ids]
    return ColmapModel(
        tuple(label for label, _ in found),
        tuple(cameras),
        np.array([p.xyz for p in points]).reshape(-1, 3),
        (np.array([p.color for p in points]).reshape(-1, 3) / 255).astype(np.float32),
        point_of[order],
        image_of[order],
        observed[order, 2:],
    )


def make_lens(camera: Camera) -> pycolmap.Camera:
    """The lens of a camera for pycolmap."""
    params = [camera.fx, camera.fy, camera.cx, camera.cy]
    return pycolmap.Camera(model="PINHOLE", width=camera.width, height=camera.height, params=params)


def write_colmap_model(model: ColmapModel, folder: Path | str) -> None:
    """Write a COLMAP model (binary) into an existing folder."""
    make_reconstruction(model).write(str(folder))


def make_reconstruction(model: ColmapModel) -> pycolmap.Reconstruction:
    """The model for pycolmap; images are numbered from 1 in the model's order."""
    stored = pycolmap.Reconstruction()
    numbers: dict[tuple, int] = {}
    place = np.zeros(len(model.pixels), int)  # of an observation among those of its image
    for i, (name, camera) in enumerate(zip(model.names, model.cameras, strict=True)):
        lens = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
        if lens not in numbers:
            numbers[lens] = len(numbers) + 1
            new = make_lens(camera)
            new.camera_id = numbers[lens]
            stored.add_camera_with_trivial_rig(new)
        own = np.flatnonzero(model.image_of == i)
        place[own] = np.arange(len(own))
        image = pycolmap.Image(name=name, keypoints=model.pixels[own], camera_id=numbers[lens], image_id=i + 1)
        pose = np.c_[camera.rotation, camera.translation]
        stored.add_image_with_trivial_frame(image, pycolmap.Rigid3d(pose))
    starts = np.searchsorted(model.point_of, np.arange(len(model.points) + 1))
    colours = np.rint(model.colours * 255).astype(np.uint8)
    for point, colour, a, b in zip(model.points, colours, starts[:-1], starts[1:], strict=True):
        track = [pycolmap.TrackElement(int(model.image_of[k]) + 1, int(place[k])) for k in range(a, b)]
        stored.add_point3D(point, pycolmap.Track(track), colour)
    stored.update_point_3d_errors()
    return stored
