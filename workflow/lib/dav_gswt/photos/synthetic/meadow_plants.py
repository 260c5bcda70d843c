"""Plants of a meadow as coloured meshes: mats of short grass, tufts, grass in seed, clover and flowers.

As in `meshes`: about 1 high (mats: about 1 across), root at the origin, one colour per face.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import meshes
from dav_gswt.photos.synthetic.meshes import (
    Mesh,
    draw_azimuths,
    grow_paths,
    make_blades,
    make_rods,
    merge_meshes,
    mix_palette,
    normalize,
    path_directions,
    scatter_on_disc,
    scatter_roots,
    to_direction,
)

GREEN = np.array([[0.17, 0.265, 0.05], [0.22, 0.31, 0.065], [0.125, 0.215, 0.042], [0.28, 0.32, 0.09]])
DRY = np.array([[0.42, 0.36, 0.17], [0.36, 0.31, 0.14]])
SEED = np.array([[0.43, 0.36, 0.20], [0.36, 0.26, 0.185], [0.38, 0.37, 0.17]])
CLOVER = np.array([[0.075, 0.165, 0.045], [0.095, 0.195, 0.06]])


@dataclass(frozen=True)
class Flower:
    """A kind of flower: its head in shares of the plant's height, and the least and greatest height in metres."""

    petals: int
    radius: float  # of the head
    width: float  # half that of a petal, as a share of the radius
    lift: float  # of a petal's tip above its base, as a share of the radius
    eye: float  # radius of the middle, as a share of the head's
    colour: tuple[float, float, float]
    middle: tuple[float, float, float]
    heights: tuple[float, float]


FLOWERS = (
    Flower(15, 0.105, 0.15, -0.05, 0.34, (0.80, 0.79, 0.74), (0.66, 0.42, 0.03), (0.16, 0.30)),  # oxeye daisy
    Flower(5, 0.075, 0.46, 0.35, 0.25, (0.78, 0.58, 0.02), (0.58, 0.46, 0.03), (0.16, 0.34)),  # buttercup
    Flower(11, 0.090, 0.22, 0.30, 0.30, (0.23, 0.19, 0.60), (0.14, 0.07, 0.30), (0.20, 0.34)),  # cornflower
    Flower(4, 0.125, 0.62, 0.50, 0.26, (0.64, 0.045, 0.03), (0.04, 0.03, 0.035), (0.22, 0.38)),  # poppy
)


def make_mat(rng: np.random.Generator, count: int, length: float, dry: float) -> Mesh:
    """Short grass on a disc about 1 across: `count` blades about `length` long. dry: share of straw."""
    root = scatter_on_disc(rng, count, 0.1 * length)
    lean = np.radians(rng.uniform(5, 70, count))
    heading = to_direction(lean, rng.uniform(0, 2 * np.pi, count))
    paths = grow_paths(rng, root, heading, length * rng.uniform(0.5, 1.3, count), joints=3, bend=0.12, droop=0.35)
    return make_grass(rng, paths, [0.055 * length, 0.048 * length, 0.004 * length], dry)


def make_tuft(rng: np.random.Generator) -> Mesh:
    """A tuft of green grass with arching blades."""
    count = int(rng.integers(55, 90))
    root = scatter_roots(rng, count, 0.09, 0.04)
    lean = np.radians(rng.uniform(2, 48, count))
    length = rng.uniform(0.5, 1.2, count)
    paths = grow_paths(
        rng, root, to_direction(lean, draw_azimuths(rng, count)), length, joints=6, bend=0.10, droop=0.20
    )
    return make_grass(rng, paths, [0.016, 0.019, 0.018, 0.015, 0.010, 0.001], dry=0.12)


def make_seed_grass(rng: np.random.Generator) -> Mesh:
    """Grass in seed: thin stems with an ear each, and some blades about the root."""
    count = int(rng.integers(6, 13))
    root = scatter_roots(rng, count, 0.05)
    lean = np.radians(rng.uniform(1, 20, count))
    stems = grow_paths(
        rng,
        root,
        to_direction(lean, draw_azimuths(rng, count)),
        rng.uniform(0.8, 1.1, count),
        6,
        0.05,
        droop=0.03,
    )
    straw = mix_palette(rng, SEED)
    ears = meshes.make_leaves(rng, stems[:, -2:], 26, straw)
    low = grow_paths(
        rng,
        root,
        to_direction(2.2 * lean, draw_azimuths(rng, count)),
        rng.uniform(0.3, 0.6, count),
        4,
        0.10,
        droop=0.22,
    )
    return merge_meshes(
        [
            make_rods(stems, 0.005, 0.003, 0.8 * straw, rng),
            ears,
            make_grass(rng, low, [0.012, 0.012, 0.009, 0.001], 0.15),
        ]
    )


def make_clover(rng: np.random.Generator) -> Mesh:
    """Clover: three leaflets at the end of every stem, spread flat."""
    count = int(rng.integers(22, 34))
    root = scatter_roots(rng, count, 0.25, 0.05)
    lean = np.radians(rng.uniform(5, 50, count))
    stems = grow_paths(rng, root, to_direction(lean, draw_azimuths(rng, count)), rng.uniform(0.6, 1.1, count), 3, 0.1)
    green = mix_palette(rng, CLOVER)
    turn = rng.uniform(0, 2 * np.pi, (count, 1)) + 2 * np.pi / 3 * np.arange(3)
    tilt = rng.normal(0, 0.25, (count, 3))
    out = np.stack([np.cos(turn), np.sin(turn), tilt], axis=-1).reshape(-1, 3)
    end = np.repeat(stems[:, -1], 3, axis=0)
    paths = np.stack([end, end + 0.13 * out, end + 0.30 * out], axis=1)
    across = normalize(np.cross(out, [0, 0, 1.0]))
    tint = green * rng.uniform(0.75, 1.3, (count * 3, 1))
    leaflets = make_blades(paths, across, [0.01, 0.13, 0.09], np.stack([tint * 1.3, tint], axis=1))
    return merge_meshes([make_rods(stems, 0.012, 0.010, green, rng), leaflets])


def make_flower(rng: np.random.Generator, kind: Flower) -> Mesh:
    """A plant with one to four stems, each with a few narrow leaves and a flower."""
    count = int(rng.integers(1, 5))
    root = scatter_roots(rng, count, 0.03)
    lean = np.radians(rng.uniform(2, 24, count))
    stems = grow_paths(rng, root, to_direction(lean, draw_azimuths(rng, count)), rng.uniform(0.7, 1.05, count), 6, 0.07)
    green = mix_palette(rng, GREEN)
    many = 12
    foot = np.repeat(root, many, axis=0)[: many * count] + rng.normal(0, 0.02, (many * count, 3))
    lie = to_direction(np.radians(rng.uniform(25, 75, len(foot))), draw_azimuths(rng, len(foot)))
    low = grow_paths(rng, foot, lie, rng.uniform(0.15, 0.42, len(foot)), 4, 0.1, droop=0.12)
    parts = [make_rods(stems, 0.012, 0.008, green, rng), meshes.make_leaves(rng, stems, 9, green)]
    parts.append(make_grass(rng, low, [0.012, 0.026, 0.022, 0.002], dry=0.05))
    for stem in stems:
        facing = normalize(path_directions(stem[None])[0, -1] + [0, 0, 0.8] + rng.normal(0, 0.18, 3))
        parts.append(make_flower_head(rng, stem[-1], facing, kind))
    return merge_meshes(parts)


def make_flower_head(rng, centre, facing, kind: Flower) -> Mesh:
    """Petals around a raised centre."""
    u = normalize(np.cross(facing, rng.normal(0, 1, 3)))
    v = np.cross(facing, u)
    radius = kind.radius * rng.uniform(0.85, 1.12)
    turn = 2 * np.pi / kind.petals * (np.arange(kind.petals) + rng.uniform(0, 1) + rng.normal(0, 0.07, kind.petals))
    out = np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v
    across = np.cross(facing, out)
    rise = radius * kind.lift * facing * rng.uniform(0.7, 1.3, (kind.petals, 1))
    long = radius * rng.uniform(0.9, 1.08, (kind.petals, 1))
    joints = [centre + 0.15 * long * out, centre + 0.62 * long * out + 0.4 * rise, centre + long * out + rise]
    wide = radius * kind.width
    tint = np.array(kind.colour) * rng.uniform(0.85, 1.08, (kind.petals, 1))
    petals = make_blades(
        np.stack(joints, 1), across, [0.35 * wide, wide, 0.6 * wide], np.stack([0.88 * tint, tint], axis=1)
    )
    ring = 2 * np.pi / 8 * np.arange(8)
    rim = centre + kind.eye * radius * (np.cos(ring)[:, None] * u + np.sin(ring)[:, None] * v) + 0.04 * radius * facing
    top = centre + 0.55 * kind.eye * radius * facing
    index = np.arange(8)
    faces = np.column_stack([index, (index + 1) % 8, np.full(8, 8)])
    eye = np.tile(np.array(kind.middle), (9, 1)).astype(np.float32)
    return merge_meshes([petals, Mesh(np.vstack([rim, top]).astype(np.float32), faces, eye)])


def make_grass(rng, paths: Float[Array, "n joints 3"], width: list[float], dry: float) -> Mesh:
    """Blades of grass along paths. dry: share of straw."""
    n, joints = paths.shape[:2]
    side = normalize(np.cross(path_directions(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    green = mix_palette(rng, GREEN) * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    straw = mix_palette(rng, DRY) * rng.uniform(0.7, 1.15, (n, 1))
    colour = np.where(rng.uniform(size=(n, 1)) < dry, straw, green)
    light = np.linspace(0.62, 1.12, joints - 1)
    return make_blades(paths, side, width, np.clip(colour[:, None] * light[:, None], 0.01, 0.95))
