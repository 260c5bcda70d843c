"""Convex hulls of the objects that stand on an area, as the terrain draws them: turned, scaled and on the surface."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int64
from numpy import ndarray as Array
from scipy.spatial import ConvexHull, QhullError
from scipy.spatial.transform import Rotation
from scipy.special import expit

from dav_gswt.field import GaussianField
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area, list_cells, place_feet

SOLID = 0.3  # least opacity of a Gaussian that belongs to a hull
DIRECTIONS = 96  # a hull has the outermost point in each, at most so many vertices


@dataclass(frozen=True)
class Hull:
    """A closed convex mesh in the frame of an export, triangles counter-clockwise from outside."""

    name: str
    vertices: Float32[Array, "v 3"]
    triangles: Int64[Array, "t 3"]


def collect_hulls(terrain: EndlessTerrain, area: Area, origin: Float[Array, "3"]) -> Iterator[Hull]:
    """The hulls of all objects whose feet lie in an area, in the order of its cells. origin: as `plan_export` has it.

    An object without any extent in space, as one of a single flat leaf, has none.
    """
    if terrain.scatter is None:
        return
    i, j, _, _ = list_cells(terrain, area.west, area.south, area.columns, area.rows)
    found = terrain.scatter.instances_in(i, j)
    feet = place_feet(terrain, found)
    shapes = [find_outermost(levels[0]) for levels in terrain.objects]
    names = [each.name for each in terrain.object_entries]
    for k, number in enumerate(found.number.tolist()):
        angle = np.radians(found.turn[k])
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        points = feet[k] + found.size[k] * shapes[number] @ turn.T
        points[:, 2] += terrain.heights.at(points[:, 0], points[:, 1])[0]
        mesh = wrap(points - origin)
        if mesh is not None:
            yield Hull(f"{names[number]}_{k}", *mesh)


def find_outermost(field: GaussianField) -> Float[Array, "k 3"]:
    """The outermost points of an object in directions all around: of its ellipsoids of one standard deviation."""
    solid = field[expit(field.opacity_logits.astype(float)) >= SOLID]
    field = solid if len(solid) else field
    axes = Rotation.from_quat(field.quats.astype(float), scalar_first=True).as_matrix()
    axes = axes * np.exp(field.log_scales.astype(float))[:, None]
    means = field.means.astype(float)
    points = []
    for direction in _spread_directions():
        along = np.einsum("nij,i->nj", axes, direction)  # how far each axis reaches in the direction
        reach = np.linalg.norm(along, axis=1)
        k = int(np.argmax(means @ direction + reach))
        points.append(means[k] + axes[k] @ along[k] / max(reach[k], 1e-30))
    return np.unique(np.round(points, 9), axis=0)


def _spread_directions() -> Float[Array, "k 3"]:
    """Directions all around, about as far apart: a Fibonacci lattice of the sphere."""
    k = np.arange(DIRECTIONS) + 0.5
    z, turn = 1 - 2 * k / DIRECTIONS, np.pi * (1 + 5**0.5) * k
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], 1)


def wrap(points: Float[Array, "n 3"]) -> tuple[Float32[Array, "v 3"], Int64[Array, "t 3"]] | None:
    """The convex hull of points, or None where they have no volume."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    corners = points[hull.simplices]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normals * hull.equations[:, :3]).sum(1) < 0
    simplices = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    used, triangles = np.unique(simplices, return_inverse=True)
    return points[used].astype(np.float32), triangles.reshape(-1, 3).astype(np.int64)
