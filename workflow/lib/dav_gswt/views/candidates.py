"""Candidate poses: where a camera may stand and look, or the photos of a replayed scene; and which are feasible.

Where photos can be taken, the scene's `poses` says which: `free` (any direction, distance and aim point over the
exemplar), `orbit` (on a hemisphere, all looking at the middle), or a table that describes a route.

Not feasible are poses in the ground or an object, too near the ground, or hidden. The ground is the whole height field
as a mesh; rays decide what is hidden. trimesh traces them by embree, or slower by rtree where embree has no package.
embree has single precision, so all coordinates are relative to the exemplar: its middle is the origin, its side the
unit.
"""

import logging
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import Camera, pinhole
from dav_gswt.geometry.poses import Pose, pose_of_camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.photos.capture_record import read_capture_record
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.lenses import find_main_camera
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.reconstruction.ground import Ground

Candidates = list[tuple[Pose, Camera]]

FREE_RADII = (0.4, 1.5)  # flying heights
REACHED_RADII = (0.4, 1.0)  # flying heights, for devices and people: never higher than the first photos were taken
LOWEST = 30.0  # degrees of elevation, of candidates of photographed scenes
HEADINGS = 4  # at each stop of a route
ANY_FIELD = 60.0  # degrees, of a camera that gets another lens
_log = logging.getLogger(__name__)
MOST = 512  # vertices of the mesh along the grid's longer side
LATTICE = 9  # test points along a side of the exemplar
SHARE = 0.5  # of the test points in the picture that must be visible
CLEARANCE = 0.05  # flying heights above the ground, at least: the height of objects on it
OFF = 1e-4  # sides of the exemplar: height above the surface at which a ray starts
SOLID = 0.5  # opacity from which a Gaussian counts as solid


def list_remaining(
    scene: dict, frame: SceneFrame, model_folder: Path | str, split: ViewSplit, captures: list
) -> Candidates:
    """List the candidates of a scene that earlier captures have not used.

    split: views.json. captures: folders of earlier rounds. Where photos are yet to be taken, all candidates have the
    lens of most pictures, the one that further photos are localised with.
    """
    if scene["agent"] == "render":
        listed = list_poses(scene, frame, synthetic.lens(scene["size"]))
    else:
        known = read_colmap_model(model_folder)
        if scene["agent"] == "replay":
            shown = [(name, known.camera(name)) for name in split.pool]
            listed = [(pose_of_camera(name, camera, frame), camera) for name, camera in shown]
        else:
            listed = list_poses(scene, frame, find_main_camera(known.cameras))
    # a photo taken in place of another is used too
    taken = [photo for folder in captures for photo in read_capture_record(folder)]
    used = {name for photo in taken for name in (photo.pose.name, photo.name)}
    return [(pose, camera) for pose, camera in listed if pose.name not in used]


def list_poses(scene: dict, frame: SceneFrame, lens: Camera) -> Candidates:
    """List the poses that a scene's `poses` describes.

    scene: its keys `agent`, `candidates` (number), `poses`, and of synthetic scenes `min_elevation` (degrees) are used.
    lens: a camera whose lens and picture all have.
    Raises: InputError: a route without length.
    """
    poses = scene["poses"]
    if isinstance(poses, str):
        found = _stand_around(scene, poses == "free", frame, lens)
    else:
        found = _stand_along_route(scene["candidates"], poses, frame, lens)
    return [(pose_of_camera(f"pose_{i:04d}", camera, frame), camera) for i, camera in enumerate(found)]


def _stand_around(scene: dict, free: bool, frame: SceneFrame, lens: Camera) -> list[Camera]:
    """Cameras all around, each looking at its own aim point (free) or all at the middle (orbit)."""
    count, lowest = scene["candidates"], scene.get("min_elevation", LOWEST)
    radii, aims = (1.0, 1.0), 0.0
    if free:
        radii, aims = FREE_RADII if scene["agent"] == "render" else REACHED_RADII, 1.0
    low, high = (frame.flying_height * radius for radius in radii)
    placed = camera_layouts.spread_free(count, lowest, (low, high), aims * frame.exemplar.side)
    return [
        _with_lens(
            camera_layouts.orbit(*place, frame.exemplar.centre + [*aim, 0.0], lens.width, lens.height, ANY_FIELD), lens
        )
        for place, aim in placed
    ]


def _stand_along_route(count: int, poses: dict, frame: SceneFrame, lens: Camera) -> list[Camera]:
    """Cameras at stops along a route, at each looking down to the ground ahead, to the left, back and to the right.

    From stop to stop the headings turn by a quarter of a right angle, so that few photos see all directions.
    """
    height, down = poses["height"] * frame.flying_height, np.radians(poses["down"])
    places = frame.exemplar.side * np.asarray(poses["places"], float)
    try:
        stops, ahead = camera_layouts.spread_along(places, -(-count // HEADINGS))
    except ValueError as error:
        raise InputError(f"poses.places: {error}") from error
    found = []
    for i, (stop, azimuth) in enumerate(zip(stops, ahead, strict=True)):
        eye = frame.exemplar.centre + [*stop, height]
        for heading in range(HEADINGS):
            turn = np.radians(azimuth + 360 / HEADINGS * (heading + (i % HEADINGS) / HEADINGS))
            way = np.array([np.cos(down) * np.cos(turn), np.cos(down) * np.sin(turn), -np.sin(down)])
            found.append(_with_lens(pinhole(eye, eye + way, lens.width, lens.height, ANY_FIELD), lens))
    return found[:count]


def _with_lens(camera: Camera, lens: Camera) -> Camera:
    return replace(camera, **{name: getattr(lens, name) for name in ("fx", "fy", "cx", "cy")})


def read_captured_cameras(model_folder: Path | str, split: ViewSplit, captures: list) -> list[Camera]:
    """Read the cameras of all photos so far."""
    known = read_colmap_model(model_folder)
    start = [known.camera(name) for name in split.start]
    return start + [photo.camera for folder in captures for photo in read_capture_record(folder)]


@dataclass(frozen=True)
class _GroundMesh:
    """The ground in coordinates of the exemplar. Vertices run row by row, from the south.

    points, normals: the test points; each is a vertex, so none lies below a triangle.
    """

    middle: Float[Array, "3"]
    side: float
    mesh: trimesh.Trimesh
    points: Float[Array, "m 3"]
    normals: Float[Array, "m 3"]

    def local(self, places: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
        return (places - self.middle) / self.side


def filter_feasible(candidates: Candidates, field: GaussianField, grid: Ground, flying_height: float) -> Candidates:
    """Keep the feasible candidates; the number of the others is logged with the reasons.

    Raises: InputError: none is feasible.
    """
    reasons = find_infeasible(candidates, field, grid, CLEARANCE * flying_height)
    if not reasons:
        return candidates
    summary = ", ".join(f"{count} {reason}" for reason, count in Counter(reasons.values()).most_common())
    if len(reasons) == len(candidates):
        raise InputError(
            f"no photo can be taken from any of the {len(candidates)} candidate poses ({summary}): set `poses` of the "
            "scene, or check its ground"
        )
    _log.info("%d of %d candidate poses are left out: %s", len(reasons), len(candidates), summary)
    return [(pose, camera) for pose, camera in candidates if pose.name not in reasons]


def find_infeasible(candidates: Candidates, field: GaussianField, grid: Ground, clearance: float) -> dict[str, str]:
    """Find infeasible poses. Returns the reason by pose name.

    clearance: least height above the ground, in world units. A pose is hidden if fewer than SHARE of the test points in
    its picture are visible, or if it shows none, and inside an object if it is within one standard deviation of a solid
    Gaussian.
    """
    if not candidates:
        return {}
    site = _build_mesh(grid)
    cameras = [camera for _, camera in candidates]
    centres = np.stack([camera.centre for camera in cameras])
    in_picture, visible = _count_visible(site, cameras, centres)
    ahead = _cast_rays(site, site.local(centres), np.stack([camera.forward for camera in cameras]))
    above = centres[:, 2] - grid.height_at(centres)
    reasons = [""] * len(candidates)
    for reason, holds in (  # the last that holds is given
        ("past the ground", ~np.isfinite(ahead)),
        ("hidden", visible < SHARE * in_picture),
        ("off the exemplar", in_picture == 0),
        ("too near the ground", above < clearance),
        ("buried", above <= 0),
        ("inside an object", find_inside_objects(centres, field)),
    ):
        reasons = [reason if bad else before for bad, before in zip(holds, reasons, strict=True)]
    return {pose.name: reason for (pose, _), reason in zip(candidates, reasons, strict=True) if reason}


def _build_mesh(grid: Ground) -> _GroundMesh:
    west, south, side = grid.exemplar
    n, m, cells = grid.first_row, grid.first_column, grid.cells
    middle = np.array([west + side / 2, south + side / 2, np.median(grid.heights[n : n + cells, m : m + cells])])
    rows, columns = (np.unique(np.linspace(0, k - 1, min(k, MOST)).round().astype(int)) for k in grid.shape)
    x = (columns + 0.5 - m - cells / 2) / cells
    y = (rows + 0.5 - n - cells / 2) / cells
    z = (grid.heights[np.ix_(rows, columns)] - middle[2]) / side
    vertices = np.stack([*np.meshgrid(x, y), z], -1).reshape(-1, 3)
    a = (np.arange(len(y) - 1)[:, None] * len(x) + np.arange(len(x) - 1)).ravel()
    b, c, d = a + 1, a + len(x), a + len(x) + 1
    faces = np.stack([a, b, d, a, d, c], 1).reshape(-1, 3)  # two a cell, upwards
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    at = (np.arange(LATTICE) + 0.5) / LATTICE - 0.5
    i, j = (np.abs(axis[:, None] - at).argmin(0) for axis in (y, x))
    places = (i[:, None] * len(x) + j).ravel()
    east, north = (slope[np.ix_(rows[i], columns[j])].ravel() for slope in grid.slopes())
    normals = np.stack([-east, -north, np.ones(len(east))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return _GroundMesh(middle, side, mesh, vertices[places], normals)


def _count_visible(
    site: _GroundMesh, cameras: list[Camera], centres: Float[Array, "n 3"]
) -> tuple[Int[Array, "n"], Int[Array, "n"]]:
    """Count the test points in each camera's picture, and how many of these are visible."""
    world = site.middle + site.side * site.points
    placed = [(camera.project(world), (camera.width, camera.height)) for camera in cameras]
    shown = np.stack([(depth > 0) & (at > 0).all(1) & (at < size).all(1) for (at, depth), size in placed])
    which, point = np.nonzero(shown)
    start = site.points[point] + OFF * site.normals[point]
    way = site.local(centres)[which] - start
    length = np.linalg.norm(way, axis=1)
    free = _cast_rays(site, start, way / length[:, None]) >= length
    return shown.sum(1), np.bincount(which, weights=free, minlength=len(cameras)).round().astype(int)


def _cast_rays(site: _GroundMesh, origins: Float[Array, "n 3"], ways: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """Distance to the ground along rays of unit direction; infinite for misses."""
    found = np.full(len(origins), np.inf)
    places, hit, _ = site.mesh.ray.intersects_location(origins, ways, multiple_hits=False)
    found[hit] = np.linalg.norm(places - origins[hit], axis=1)
    return found


def find_inside_objects(centres: Float[Array, "n 3"], field: GaussianField) -> Bool[Array, "n"]:
    """Which positions are within one standard deviation of a solid Gaussian's centre."""
    solid = np.flatnonzero(expit(field.opacity_logits) >= SOLID)
    reach = np.exp(field.log_scales[solid].max(1).astype(float))
    # most Gaussians reach no position at all: they are left out before each position looks at the others
    apart, _ = cKDTree(centres).query(field.means[solid], distance_upper_bound=2 * reach.max(initial=1e-30))
    solid = solid[np.asarray(apart) <= 1.01 * reach]
    means, scales = field.means[solid].astype(float), np.exp(field.log_scales[solid].astype(float))
    found = np.zeros(len(centres), bool)
    for i, centre in enumerate(centres):
        apart = means - centre
        near = np.flatnonzero((apart**2).sum(1) <= scales.max(1) ** 2)
        if len(near):
            own = Rotation.from_quat(field.quats[solid][near], scalar_first=True).inv().apply(apart[near])
            found[i] = (((own / scales[near]) ** 2).sum(1) <= 1).any()
    return found
