"""What stands on synthetic ground, as coloured triangle meshes: here stones, dry shrubs and tufts of dry grass.

Plants are about 1 high, their root at the origin, and every face of theirs is of one colour; stones are about 1 across
with their middle at the origin. Colours are linear reflectances. What a plant is put together from (stems, blades,
leaves) serves other plants too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

BARK = np.array([[0.26, 0.20, 0.145], [0.20, 0.155, 0.115], [0.33, 0.265, 0.195]])
LEAF = np.array([[0.235, 0.235, 0.125], [0.36, 0.30, 0.15], [0.29, 0.275, 0.175], [0.40, 0.32, 0.19]])
STRAW = np.array([[0.56, 0.44, 0.235], [0.48, 0.40, 0.22], [0.60, 0.50, 0.30]])
ROCK = np.array([[0.36, 0.28, 0.20], [0.22, 0.17, 0.13], [0.50, 0.40, 0.29], [0.42, 0.26, 0.16], [0.58, 0.50, 0.39]])

Colours = tuple[Float[Array, "k 3"], Float[Array, "3"]]  # of rock, and of the dust that settles on it
DESERT_STONES: Colours = (ROCK, np.array([0.56, 0.42, 0.27]))


@dataclass(frozen=True)
class Mesh:
    """Triangles; a colour a vertex, or none where a texture gives it.

    smooth: shaded with normals averaged over the faces that share a vertex.
    """

    vertices: Float32[Array, "v 3"]
    faces: Int[Array, "f 3"]
    colours: Float32[Array, "v 3"] | None
    smooth: bool = False


def merged(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one. Raises: ValueError: none given."""
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([m.colours for m in meshes]),
        meshes[0].smooth,
    )


def placed(mesh: Mesh, where, size, yaw: float) -> Mesh:
    """A mesh scaled (by a number or along its axes), turned about z by `yaw` radians and moved."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    vertices = (mesh.vertices * size) @ turn.T + where
    return Mesh(vertices.astype(np.float32), mesh.faces, mesh.colours, mesh.smooth)


def icosphere(subdivisions: int) -> tuple[Float[Array, "v 3"], Int[Array, "f 3"]]:
    """A unit sphere of 20 * 4^subdivisions triangles, seen counter-clockwise from outside."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    text = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8"
    text += " 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 2 4 11 6 2 10 8 6 7 9 8 1"
    vertices = np.array(points, float) / np.hypot(1, g)
    faces = np.array(text.split(), int).reshape(-1, 3)
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, which = np.unique(edges, axis=0, return_inverse=True)
        middle = vertices[unique].sum(axis=1)
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        ab, bc, ca = (which.reshape(-1, 3) + len(vertices)).T
        a, b, c = faces.T
        faces = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
        vertices = np.concatenate([vertices, middle])
    return vertices, faces


def stone(rng: np.random.Generator, subdivisions: int, palette: Colours = DESERT_STONES) -> Mesh:
    """A weathered stone: a sphere cut by random planes whose edges are worn, then roughened and squeezed.

    With unit normals n_k at distances d_k the radius along v is (sum_k max(n_k.v, 0)^p / d_k^p)^(-1/p): the inner hull
    of the planes for p -> inf, rounded for the p = 14 used here.
    """
    sphere, faces = icosphere(subdivisions)
    normals = rng.standard_normal((16, 3))
    normals = np.concatenate([normals / np.linalg.norm(normals, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    distance = np.concatenate([rng.uniform(0.68, 1.0, 16), np.ones(6)])
    reach = (np.maximum(sphere @ normals.T, 0) / distance) ** 14
    radius = reach.sum(axis=1) ** (-1 / 14)
    waves = rng.standard_normal((10, 3)) * rng.uniform(2.0, 7.0, (10, 1))
    rough = np.cos(sphere @ waves.T + rng.uniform(0, 2 * np.pi, 10)).mean(axis=1)
    squeeze = np.array([1.0, rng.uniform(0.66, 0.95), rng.uniform(0.48, 0.75)])
    vertices = 0.5 * sphere * (radius * (1 + 0.06 * rough))[:, None] * squeeze
    rock, settled = palette
    base = mixed(rng, rock)
    dust = np.clip(sphere[:, 2:], 0, 1) * rng.uniform(0.0, 0.35)
    colours = base * (1 + 0.28 * rough[:, None]) * (1 - dust) + dust * settled
    return Mesh(vertices.astype(np.float32), faces, colours.astype(np.float32))


def shrub(rng: np.random.Generator) -> Mesh:
    """A dry desert shrub: bent stems that spread from one root, twigs along them, small stiff leaves on the twigs."""
    stems = int(rng.integers(26, 36))
    lean = np.radians(rng.uniform(8, 78, stems))
    length = rng.uniform(0.7, 1.05, stems) * (0.82 + 0.18 * np.cos(lean))
    root = np.column_stack([rng.normal(0, 0.035, (stems, 2)), np.full(stems, -0.03)])
    paths = grown(rng, root, direction(lean, around(rng, stems)), length, joints=5, bend=0.16)
    share = rng.uniform(0.25, 1.0, (stems, 13))
    start = along(paths, share)
    heading = np.repeat(headings(paths)[:, -1], 13, axis=0) + rng.normal(0, 0.62, (stems * 13, 3)) + [0, 0, 0.12]
    long = rng.uniform(0.16, 0.36, stems * 13)
    twigs = grown(rng, start.reshape(-1, 3), unit(heading), long, joints=3, bend=0.22)
    bark, leaf = mixed(rng, BARK), mixed(rng, LEAF)
    parts = [rods(paths, 0.012, 0.005, bark, rng), rods(twigs, 0.0045, 0.002, bark * 1.12, rng)]
    parts.append(leaves(rng, twigs, int(rng.integers(7, 15)), leaf))
    return merged(parts)


def tuft(rng: np.random.Generator) -> Mesh:
    """A tuft of dry grass: arching blades, each of one colour."""
    n = int(rng.integers(70, 110))
    root = np.column_stack([rng.normal(0, 0.07, (n, 2)), np.full(n, -0.02)])
    lean = np.radians(rng.uniform(3, 55, n))
    paths = grown(rng, root, direction(lean, around(rng, n)), rng.uniform(0.5, 1.1, n), joints=5, bend=0.10, droop=0.22)
    side = unit(np.cross(headings(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    shade = rng.uniform(0.7, 1.2, (n, 1))
    colours = mixed(rng, STRAW) * shade
    return blades(paths, side, [0.011, 0.012, 0.010, 0.007, 0.001], np.repeat(colours[:, None], 4, axis=1))


def blades(
    paths: Float[Array, "n joints 3"],
    side: Float[Array, "n 3"],
    width: list[float],
    colours: Float[Array, "n pieces 3"],
) -> Mesh:
    """Flat blades along paths, `width` to either side at each joint; a colour for each piece between joints."""
    n, pieces = colours.shape[:2]
    reach = side[:, None] * np.array(width)[None, :, None]
    one, other = paths - reach, paths + reach
    corners = np.stack([one[:, :-1], other[:, :-1], other[:, 1:], one[:, 1:]], axis=2)  # n, pieces, 4, 3
    first = 4 * np.arange(n * pieces)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    painted = np.repeat(colours.reshape(-1, 3), 4, axis=0)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), faces, painted.astype(np.float32))


def grown(rng, start, direction, length, joints: int, bend: float, droop: float = -0.05) -> Float[Array, "n joints 3"]:
    """Paths of `joints` points that leave `start` along `direction`, turn at random and sink (or rise) by `droop`."""
    points, heading = [start], direction
    for _ in range(joints - 1):
        points.append(points[-1] + heading * (length / (joints - 1))[:, None])
        heading = unit(heading + rng.normal(0, bend, heading.shape) - [0, 0, droop])
    return np.stack(points, axis=1)


def rods(paths, thick: float, thin: float, colour, rng) -> Mesh:
    """Three-sided rods along paths, tapering from radius `thick` to `thin`."""
    n, joints = paths.shape[:2]
    across = unit(np.cross(headings(paths)[:, :1], rng.normal(0, 1, (n, 1, 3))))
    up = unit(np.cross(headings(paths)[:, :1], across))
    radius = np.linspace(thick, thin, joints)[None, :, None]
    ring = [paths + radius * (np.cos(t) * across + np.sin(t) * up) for t in 2 * np.pi / 3 * np.arange(3)]
    vertices = np.stack(ring, axis=2)  # n, joints, 3, 3
    index = np.arange(n * joints * 3).reshape(n, joints, 3)
    a, b = index[:, :-1], np.roll(index, -1, axis=2)[:, :-1]
    c, d = np.roll(index, -1, axis=2)[:, 1:], index[:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    shade = rng.uniform(0.75, 1.2, (n, 1, 1, 1)) * np.ones((1, joints, 3, 1))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, (shade * colour).reshape(-1, 3).astype(np.float32))


def leaves(rng, twigs, each: int, colour) -> Mesh:
    """Rhombic leaves, `each` on a twig, pointing outwards and up, about 0.05 long."""
    n = len(twigs) * each
    base = along(twigs, rng.uniform(0.15, 1.0, (len(twigs), each))).reshape(-1, 3)
    ahead = np.repeat(headings(twigs)[:, -1], each, axis=0)
    ahead = unit(ahead + rng.normal(0, 0.8, (n, 3))) * rng.uniform(0.035, 0.07, (n, 1))
    wide = unit(np.cross(ahead, rng.normal(0, 1, (n, 3)))) * rng.uniform(0.007, 0.014, (n, 1))
    vertices = np.stack([base, base + 0.5 * ahead + wide, base + ahead, base + 0.5 * ahead - wide], axis=1)
    first = 4 * np.arange(n)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    tint = colour * rng.uniform(0.7, 1.3, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, np.repeat(tint, 4, axis=0).astype(np.float32))


def along(paths: Float[Array, "n joints 3"], share: Float[Array, "n m"]) -> Float[Array, "n m 3"]:
    """Points at shares 0 to 1 of every path."""
    place = share * (paths.shape[1] - 1)
    first = np.minimum(place.astype(int), paths.shape[1] - 2)
    row, rest = np.arange(len(paths))[:, None], (place - first)[..., None]
    return paths[row, first] * (1 - rest) + paths[row, first + 1] * rest


def headings(paths):
    return unit(np.diff(paths, axis=1))


def direction(lean, azimuth):
    return np.column_stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])


def around(rng, n: int):
    """n azimuths, evenly spread but for a jitter."""
    return 2 * np.pi * (rng.permutation(n) + rng.uniform(-0.4, 0.4, n)) / n


def unit(v):
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def mixed(rng, palette):
    """A colour between the palette's, mostly near one of them."""
    weight = rng.dirichlet(np.full(len(palette), 0.45))
    return weight @ palette * rng.uniform(0.9, 1.1)
