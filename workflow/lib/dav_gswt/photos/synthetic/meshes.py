"""Coloured triangle meshes of stones, dry shrubs and tufts, and the parts of all plants: stems, blades, leaves.

Plants are about 1 high with their root at the origin, and each face has one colour; stones are about 1 across with
their centre at the origin. Colours are linear reflectances.
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
    """Triangles. colours: per vertex; None where a texture gives them. smooth: shaded with vertex normals."""

    vertices: Float32[Array, "v 3"]
    faces: Int[Array, "f 3"]
    colours: Float32[Array, "v 3"] | None
    smooth: bool = False


def merge_meshes(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one; all have colours. Raises: ValueError: no mesh."""
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([m.colours for m in meshes if m.colours is not None]),
        meshes[0].smooth,
    )


def transform_mesh(mesh: Mesh, where, size, yaw: float) -> Mesh:
    """Scale a mesh (by a number or along its axes), turn it about z by `yaw` radians and move it."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    vertices = (mesh.vertices * size) @ turn.T + where
    return Mesh(vertices.astype(np.float32), mesh.faces, mesh.colours, mesh.smooth)


def make_stone(rng: np.random.Generator, subdivisions: int, palette: Colours = DESERT_STONES) -> Mesh:
    """A weathered stone: a sphere cut by random planes whose edges are worn, then roughened and squeezed.

    With unit normals n_k at distances d_k the radius along v is (sum_k max(n_k.v, 0)^p / d_k^p)^(-1/p): the inner hull
    of the planes for p -> inf, rounded for the p = 14 used here.
    """
    import trimesh  # deferred: it takes long to load, and what only poses cameras makes no stone

    icosphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    sphere, faces = np.array(icosphere.vertices), np.array(icosphere.faces)
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
    base = mix_palette(rng, rock)
    dust = np.clip(sphere[:, 2:], 0, 1) * rng.uniform(0.0, 0.35)
    colours = base * (1 + 0.28 * rough[:, None]) * (1 - dust) + dust * settled
    return Mesh(vertices.astype(np.float32), faces, colours.astype(np.float32))


def make_shrub(
    rng: np.random.Generator, palette: Float[Array, "k 3"] = LEAF, leaves: tuple[int, int] = (7, 15)
) -> Mesh:
    """A desert shrub: bent stems that spread from one root, with twigs and small stiff leaves.

    palette: of its leaves. leaves: on a twig, from the first number to below the second.
    """
    stems = int(rng.integers(26, 36))
    lean = np.radians(rng.uniform(8, 78, stems))
    length = rng.uniform(0.7, 1.05, stems) * (0.82 + 0.18 * np.cos(lean))
    root = scatter_roots(rng, stems, 0.035)
    paths = grow_paths(rng, root, to_direction(lean, draw_azimuths(rng, stems)), length, joints=5, bend=0.16)
    share = rng.uniform(0.25, 1.0, (stems, 13))
    start = sample_paths(paths, share)
    heading = np.repeat(path_directions(paths)[:, -1], 13, axis=0) + rng.normal(0, 0.62, (stems * 13, 3)) + [0, 0, 0.12]
    long = rng.uniform(0.16, 0.36, stems * 13)
    twigs = grow_paths(rng, start.reshape(-1, 3), normalize(heading), long, joints=3, bend=0.22)
    bark, leaf = mix_palette(rng, BARK), mix_palette(rng, palette)
    parts = [make_rods(paths, 0.012, 0.005, bark, rng), make_rods(twigs, 0.0045, 0.002, bark * 1.12, rng)]
    parts.append(make_leaves(rng, twigs, int(rng.integers(*leaves)), leaf))
    return merge_meshes(parts)


def make_tuft(rng: np.random.Generator) -> Mesh:
    """A tuft of dry grass: arching blades, each of one colour."""
    n = int(rng.integers(70, 110))
    root = scatter_roots(rng, n, 0.07, 0.02)
    lean = np.radians(rng.uniform(3, 55, n))
    paths = grow_paths(
        rng,
        root,
        to_direction(lean, draw_azimuths(rng, n)),
        rng.uniform(0.5, 1.1, n),
        joints=5,
        bend=0.10,
        droop=0.22,
    )
    side = normalize(np.cross(path_directions(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    shade = rng.uniform(0.7, 1.2, (n, 1))
    colours = mix_palette(rng, STRAW) * shade
    return make_blades(paths, side, [0.011, 0.012, 0.010, 0.007, 0.001], np.repeat(colours[:, None], 4, axis=1))


def scatter_roots(rng: np.random.Generator, count: int, spread: float, depth: float = 0.03) -> Float[Array, "n 3"]:
    """Roots about the origin, normally distributed, a little below the ground."""
    return np.column_stack([rng.normal(0, spread, (count, 2)), np.full(count, -depth)])


def scatter_on_disc(rng: np.random.Generator, count: int, depth: float) -> Float[Array, "n 3"]:
    """Places spread evenly over a disc 1 across, `depth` below the ground."""
    radius, turn = 0.5 * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, -depth)])


def make_blades(
    paths: Float[Array, "n joints 3"],
    side: Float[Array, "n 3"],
    width: list[float],
    colours: Float[Array, "n pieces 3"],
) -> Mesh:
    """Flat blades along paths, `width` to either side of each joint, with a colour per piece between joints."""
    n, pieces = colours.shape[:2]
    reach = side[:, None] * np.array(width)[None, :, None]
    one, other = paths - reach, paths + reach
    corners = np.stack([one[:, :-1], other[:, :-1], other[:, 1:], one[:, 1:]], axis=2)  # n, pieces, 4, 3
    first = 4 * np.arange(n * pieces)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    by_vertex = np.repeat(colours.reshape(-1, 3), 4, axis=0)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), faces, by_vertex.astype(np.float32))


def grow_paths(
    rng, start, direction, length, joints: int, bend: float, droop: float = -0.05
) -> Float[Array, "n joints 3"]:
    """Paths of `joints` points from `start` along `direction` that bend at random and sink (or rise) by `droop`."""
    points, heading = [start], direction
    for _ in range(joints - 1):
        points.append(points[-1] + heading * (length / (joints - 1))[:, None])
        heading = normalize(heading + rng.normal(0, bend, heading.shape) - [0, 0, droop])
    return np.stack(points, axis=1)


def make_rods(paths, thick: float, thin: float, colour, rng) -> Mesh:
    """Three-sided rods along paths, their radius falling from `thick` to `thin`."""
    n, joints = paths.shape[:2]
    across = normalize(np.cross(path_directions(paths)[:, :1], rng.normal(0, 1, (n, 1, 3))))
    up = normalize(np.cross(path_directions(paths)[:, :1], across))
    radius = np.linspace(thick, thin, joints)[None, :, None]
    ring = [paths + radius * (np.cos(t) * across + np.sin(t) * up) for t in 2 * np.pi / 3 * np.arange(3)]
    vertices = np.stack(ring, axis=2)  # n, joints, 3, 3
    index = np.arange(n * joints * 3).reshape(n, joints, 3)
    a, b = index[:, :-1], np.roll(index, -1, axis=2)[:, :-1]
    c, d = np.roll(index, -1, axis=2)[:, 1:], index[:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    shade = rng.uniform(0.75, 1.2, (n, 1, 1, 1)) * np.ones((1, joints, 3, 1))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, (shade * colour).reshape(-1, 3).astype(np.float32))


def make_leaves(rng, twigs, each: int, colour) -> Mesh:
    """Rhombic leaves, `each` per twig, about 0.05 long."""
    n = len(twigs) * each
    base = sample_paths(twigs, rng.uniform(0.15, 1.0, (len(twigs), each))).reshape(-1, 3)
    ahead = np.repeat(path_directions(twigs)[:, -1], each, axis=0)
    ahead = normalize(ahead + rng.normal(0, 0.8, (n, 3))) * rng.uniform(0.035, 0.07, (n, 1))
    wide = normalize(np.cross(ahead, rng.normal(0, 1, (n, 3)))) * rng.uniform(0.007, 0.014, (n, 1))
    vertices = np.stack([base, base + 0.5 * ahead + wide, base + ahead, base + 0.5 * ahead - wide], axis=1)
    first = 4 * np.arange(n)[:, None]
    faces = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
    tint = colour * rng.uniform(0.7, 1.3, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, np.repeat(tint, 4, axis=0).astype(np.float32))


def sample_paths(paths: Float[Array, "n joints 3"], share: Float[Array, "n m"]) -> Float[Array, "n m 3"]:
    """Points at shares 0 to 1 of every path."""
    place = share * (paths.shape[1] - 1)
    first = np.minimum(place.astype(int), paths.shape[1] - 2)
    row, rest = np.arange(len(paths))[:, None], (place - first)[..., None]
    return paths[row, first] * (1 - rest) + paths[row, first + 1] * rest


def path_directions(paths: Float[Array, "n joints 3"]) -> Float[Array, "n pieces 3"]:
    """Unit vectors between the joints of paths."""
    return normalize(np.diff(paths, axis=1))


def to_direction(lean, azimuth) -> Float[Array, "n 3"]:
    """Unit vectors by their angle to the vertical and their azimuth, radians."""
    return np.column_stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])


def draw_azimuths(rng, n: int) -> Float[Array, "n"]:
    """n azimuths, evenly spread with some jitter, in random order."""
    return 2 * np.pi * (rng.permutation(n) + rng.uniform(-0.4, 0.4, n)) / n


def normalize(v: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """Vectors of length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def mix_palette(rng, palette: Float[Array, "k 3"]) -> Float[Array, "3"]:
    """A random mixture of a palette's colours, mostly near one of them."""
    weight = rng.dirichlet(np.full(len(palette), 0.45))
    return weight @ palette * rng.uniform(0.9, 1.1)
