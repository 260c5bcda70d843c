"""Coloured triangle meshes: stones and rocks, about 1 across with their centre at the origin.

Colours are linear reflectances.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int
from numpy import ndarray as Array

Colours = tuple[Float[Array, "k 3"], Float[Array, "3"]]  # of rock, and of the dust that settles on it


@dataclass(frozen=True)
class Mesh:
    """Triangles. colours: per vertex; None where a texture gives them. smooth: shaded with vertex normals."""

    vertices: Float32[Array, "v 3"]
    faces: Int[Array, "f 3"]
    colours: Float32[Array, "v 3"] | None
    smooth: bool = False


def merge_meshes(meshes: list[Mesh]) -> Mesh:
    """Several meshes with colours as one. Raises: ValueError: no mesh."""
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes[:-1]])
    return Mesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.faces + s for m, s in zip(meshes, starts, strict=True)]),
        np.concatenate([m.colours for m in meshes if m.colours is not None]),
        meshes[0].smooth,
    )


def transform_mesh(mesh: Mesh, where, size, yaw: float) -> Mesh:
    """Scale a mesh, turn it about z by `yaw` radians and move it."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    vertices = (mesh.vertices * size) @ turn.T + where
    return Mesh(vertices.astype(np.float32), mesh.faces, mesh.colours, mesh.smooth)


def make_stone(rng: np.random.Generator, subdivisions: int, palette: Colours) -> Mesh:
    """A weathered stone: a sphere cut by random planes whose edges are worn, then roughened and squeezed."""
    sphere, faces = _make_sphere(subdivisions)
    normals = rng.standard_normal((16, 3))
    normals = np.concatenate([normals / np.linalg.norm(normals, axis=1, keepdims=True), np.eye(3), -np.eye(3)])
    radius = _hull(sphere, normals, np.concatenate([rng.uniform(0.68, 1.0, 16), np.ones(6)]), 14)
    waves = rng.standard_normal((10, 3)) * rng.uniform(2.0, 7.0, (10, 1))
    rough = np.cos(sphere @ waves.T + rng.uniform(0, 2 * np.pi, 10)).mean(axis=1)
    squeeze = np.array([1.0, rng.uniform(0.66, 0.95), rng.uniform(0.48, 0.75)])
    vertices = 0.5 * sphere * (radius * (1 + 0.06 * rough))[:, None] * squeeze
    rock, settled = palette
    base = mix_palette(rng, rock)
    dust = np.clip(sphere[:, 2:], 0, 1) * rng.uniform(0.0, 0.35)
    colours = base * (1 + 0.28 * rough[:, None]) * (1 - dust) + dust * settled
    return Mesh(vertices.astype(np.float32), faces, colours.astype(np.float32))


def make_rock(rng: np.random.Generator, subdivisions: int, palette: Colours) -> Mesh:
    """A broken rock: a sphere cut by few random planes with sharp edges, rough at all scales, pitted, dusty on top.

    Each face has one colour, as instances need it.
    """
    sphere, faces = _make_sphere(subdivisions)
    count = int(rng.integers(7, 13))
    normals = np.concatenate([normalize(rng.standard_normal((count, 3))), np.eye(3), -np.eye(3)])
    hull = _hull(sphere, normals, np.concatenate([rng.uniform(0.55, 1.0, count), np.ones(6)]), 44)
    radius = hull * (1 + _roughness(rng, sphere)) - _pits(rng, sphere)
    squeeze = np.array([1.0, rng.uniform(0.62, 0.95), rng.uniform(0.45, 0.85)])
    corners = (0.5 * sphere * radius[:, None] * squeeze)[faces]
    normal = normalize(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    rocky, settled = palette
    tone = np.exp(0.9 * _roughness(rng, sphere[faces[:, 0]]) + rng.normal(0, 0.06, len(faces)))
    dust = np.clip(1.6 * normal[:, 2] - rng.uniform(0.3, 1.2), 0, 0.85)[:, None]
    colours = mix_palette(rng, rocky) * tone[:, None] * (1 - dust) + dust * settled
    by_vertex = np.clip(colours, 0.01, 0.9).repeat(3, axis=0).astype(np.float32)
    return Mesh(corners.reshape(-1, 3).astype(np.float32), np.arange(3 * len(faces)).reshape(-1, 3), by_vertex)


def _make_sphere(subdivisions: int) -> tuple[Float[Array, "v 3"], Int[Array, "f 3"]]:
    import trimesh  # deferred: it takes long to load, and what only poses cameras makes no stone

    icosphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    return np.array(icosphere.vertices), np.array(icosphere.faces)


def _hull(sphere, normals, distance, hard: int) -> Float[Array, "v"]:
    """The radius of the inner hull of planes with normals n_k at distances d_k, with edges rounded by the exponent p.

    Along v it is (sum_k max(n_k.v, 0)^p / d_k^p)^(-1/p).
    """
    return ((np.maximum(sphere @ normals.T, 0) / distance) ** hard).sum(axis=1) ** (-1 / hard)


def _roughness(rng, at) -> Float[Array, "v"]:
    """Four octaves of waves about 0, up to 0.15 or so."""
    total = np.zeros(len(at))
    for octave in range(4):
        waves = normalize(rng.standard_normal((9, 3))) * 2.6 * 2.0**octave * rng.uniform(0.7, 1.4, (9, 1))
        total += 0.085 * 0.55**octave * np.cos(at @ waves.T + rng.uniform(0, 2 * np.pi, 9)).sum(axis=1) / 3
    return total


def _pits(rng, sphere) -> Float[Array, "v"]:
    """Depth of round pits, from none to many on a rock."""
    count = int(rng.integers(0, 26))
    centre, width = normalize(rng.standard_normal((count, 3))), rng.uniform(0.06, 0.16, count)
    off = 2 * (1 - sphere @ centre.T) / width**2
    return (0.35 * width * np.exp(-off)).max(axis=1, initial=0.0)


def draw_sizes(rng: np.random.Generator, count: int, least: float, most: float, steep: float) -> Float[Array, "n"]:
    """Random sizes between least and most, whose density falls as size^-steep (steep is not 1)."""
    power = 1 - steep
    return (least**power + rng.uniform(size=count) * (most**power - least**power)) ** (1 / power)


def normalize(v: Float[Array, "*n 3"]) -> Float[Array, "*n 3"]:
    """Vectors of length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


def mix_palette(rng, palette: Float[Array, "k 3"]) -> Float[Array, "3"]:
    """A random mixture of a palette's colours, mostly near one of them."""
    weight = rng.dirichlet(np.full(len(palette), 0.45))
    return weight @ palette * rng.uniform(0.9, 1.1)
