"""Flowering plants as coloured meshes: leafy, branching plants, and swathes of many plants for far away.

As in `meshes`: about 1 high (swathes: about 1 across), root at the origin, one colour per face.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import meadow_plants, meshes
from dav_gswt.photos.synthetic.meadow_plants import Flower
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
    sample_paths,
    scatter_on_disc,
    scatter_roots,
    to_direction,
)

LEAF = np.array([[0.135, 0.255, 0.06], [0.18, 0.30, 0.07], [0.105, 0.21, 0.065]])
GREY = np.array([[0.17, 0.235, 0.13], [0.21, 0.265, 0.155], [0.145, 0.21, 0.10]])
PALE = np.array([[0.20, 0.29, 0.065], [0.25, 0.32, 0.085], [0.16, 0.25, 0.06]])
TIP = 0.0008  # half width of a leaf's end, as a share of its plant


@dataclass(frozen=True)
class Habit:
    """The growth of a plant. stems: from the root, least and most. heads: flowers per stem. lean: of stems.

    leaf: length and half the width, as shares of the plant's height. many: leaves per stem.
    """

    stems: tuple[int, int]
    heads: int
    lean: float  # degrees
    leaf: tuple[float, float]
    many: int
    green: Float[Array, "k 3"]


@dataclass(frozen=True)
class Kind:
    """A kind of flowering plant. other: the colour towards which that of single plants varies."""

    flower: Flower
    habit: Habit
    other: tuple[float, float, float] | None = None


WHITE, YOLK, DARK = (0.82, 0.81, 0.77), (0.68, 0.43, 0.03), (0.045, 0.03, 0.04)
FEATHERY = Habit((4, 8), 2, 24.0, (0.20, 0.007), 12, GREY)
LEAFY = Habit((4, 7), 2, 28.0, (0.24, 0.024), 10, LEAF)
SLENDER = Habit((6, 10), 2, 30.0, (0.16, 0.012), 8, PALE)
LOW = Habit((7, 12), 1, 48.0, (0.42, 0.060), 4, LEAF)
POPPY = Kind(Flower(5, 0.088, 0.62, 0.50, 0.24, (0.66, 0.035, 0.02), DARK, (0.36, 0.60)), FEATHERY, (0.78, 0.16, 0.05))
CORNFLOWER = Kind(Flower(11, 0.054, 0.26, 0.40, 0.34, (0.10, 0.12, 0.62), (0.12, 0.05, 0.30), (0.40, 0.64)), FEATHERY)
OXEYE = Kind(Flower(16, 0.070, 0.16, -0.06, 0.34, WHITE, YOLK, (0.34, 0.54)), LEAFY)
BUTTERCUP = Kind(Flower(5, 0.050, 0.50, 0.40, 0.26, (0.82, 0.60, 0.015), (0.62, 0.48, 0.03), (0.28, 0.50)), SLENDER)
COSMOS = Kind(Flower(8, 0.075, 0.36, 0.12, 0.20, (0.74, 0.17, 0.43), YOLK, (0.40, 0.62)), FEATHERY, (0.84, 0.55, 0.68))
MARIGOLD = Kind(Flower(19, 0.120, 0.14, 0.15, 0.32, (0.86, 0.32, 0.015), (0.50, 0.19, 0.02), (0.20, 0.32)), LEAFY)
DAISY = Kind(Flower(17, 0.125, 0.12, 0.04, 0.36, WHITE, (0.72, 0.52, 0.04), (0.09, 0.16)), LOW, (0.84, 0.66, 0.70))
DISCS = (POPPY, CORNFLOWER, OXEYE, BUTTERCUP, COSMOS, MARIGOLD, DAISY)
LARKSPUR, LUPIN = np.array([0.20, 0.11, 0.55]), np.array([0.58, 0.20, 0.42])
LACE = np.array([0.76, 0.76, 0.68])


def make_bush(rng: np.random.Generator, kind: Kind) -> Mesh:
    """A plant with leafy stems that branch, each branch with a flower that faces up and outwards."""
    habit = kind.habit
    stems = _grow_stems(rng, int(rng.integers(*habit.stems)), habit.lean)
    green = mix_palette(rng, habit.green)
    tops = stems[:, 3:]
    if habit.heads > 1:
        tops = np.concatenate([tops, _grow_forks(rng, stems, habit.heads - 1)])
    parts = [make_rods(stems, 0.0085, 0.0045, green, rng), make_rods(tops, 0.0045, 0.0035, green, rng)]
    parts.append(make_foliage(rng, stems, habit, green))
    flower = _vary_flower(rng, kind)
    for top in tops:
        facing = normalize(path_directions(top[None])[0, -1] + [0, 0, 0.9] + rng.normal(0, 0.22, 3))
        parts.append(meadow_plants.make_flower_head(rng, top[-1], facing, flower))
    return merge_meshes(parts)


def make_spire(rng: np.random.Generator, colour: Float[Array, "3"]) -> Mesh:
    """A tall plant with florets around the upper half of its stems, the smaller the higher."""
    habit = Habit((2, 5), 1, 14.0, (0.22, 0.030), 14, LEAF)
    stems = _grow_stems(rng, int(rng.integers(*habit.stems)), habit.lean)
    green = mix_palette(rng, habit.green)
    tint = np.array(colour) * rng.uniform(0.85, 1.15)
    parts = [make_rods(stems, 0.010, 0.004, green, rng), make_foliage(rng, stems, habit, green, until=0.55)]
    share = np.linspace(0.48, 0.99, 44)[None].repeat(len(stems), 0)
    centre = sample_paths(stems, share).reshape(-1, 3)
    size = (0.048 * (1.15 - share) / 0.67 + 0.009).reshape(-1, 1)
    turn = (np.arange(len(centre)) * 2.4 + rng.uniform(0, 0.6, len(centre)))[:, None]
    out = np.concatenate([np.cos(turn), np.sin(turn), rng.normal(0.15, 0.2, turn.shape)], axis=1)
    for swing in (-0.55, 0.0, 0.55):
        lobe = normalize(out + swing * np.cross(out, [0, 0, 1.0]) + [0, 0, 0.25 * (swing == 0)]) * size
        paths = np.stack([centre, centre + 0.55 * lobe, centre + lobe], axis=1)
        side = normalize(np.cross(lobe, rng.normal(0, 0.4, lobe.shape) + [0, 0, 1.0]))
        shade = tint * rng.uniform(0.75, 1.2, (len(lobe), 1))
        parts.append(make_blades(paths, side, [0.004, 0.014, 0.006], np.stack([0.85 * shade, shade], axis=1)))
    return merge_meshes(parts)


def make_umbel(rng: np.random.Generator) -> Mesh:
    """A plant with flat heads of tiny white florets on rays, as of yarrow or wild carrot."""
    habit = Habit((3, 6), 2, 20.0, (0.26, 0.014), 10, GREY)
    stems = _grow_stems(rng, int(rng.integers(*habit.stems)), habit.lean)
    green = mix_palette(rng, habit.green)
    tops = np.concatenate([stems[:, 3:], _grow_forks(rng, stems, 1)])
    parts = [make_rods(stems, 0.008, 0.004, green, rng), make_rods(tops, 0.004, 0.003, green, rng)]
    parts.append(make_foliage(rng, stems, habit, green))
    for top in tops:
        parts.append(_make_lace(rng, top[-1], 0.085 * rng.uniform(0.6, 1.15), green))
    return merge_meshes(parts)


def make_foliage(rng: np.random.Generator, stems, habit: Habit, green, until: float = 0.85) -> Mesh:
    """Pointed, arching leaves along stems up to a share of them, paler at the tip."""
    share = rng.uniform(0.02, 1.0, (len(stems), habit.many)) ** 1.3 * until
    start = sample_paths(stems, share).reshape(-1, 3)
    count = len(start)
    lean = np.radians(rng.uniform(30, 85, count))
    long = habit.leaf[0] * (1.15 - 0.6 * share.reshape(-1)) * rng.uniform(0.7, 1.2, count)
    paths = grow_paths(rng, start, to_direction(lean, rng.uniform(0, 2 * np.pi, count)), long, 5, 0.09, droop=0.12)
    side = normalize(np.cross(path_directions(paths)[:, 0], [0, 0, 1.0] + rng.normal(0, 0.35, (count, 3))))
    wide = habit.leaf[1] * np.array([0.35, 0.9, 1.0, 0.6, 0.0]) + TIP
    tint = green * rng.uniform(0.7, 1.25, (count, 1)) * rng.uniform(0.93, 1.07, (count, 3))
    shade = np.linspace(0.75, 1.15, 4)[None, :, None]
    return make_blades(paths, side, list(wide), np.clip(tint[:, None] * shade, 0.01, 0.95))


def make_swathe(rng: np.random.Generator, plants: list[Mesh], count: int, heights: tuple[float, float]) -> Mesh:
    """`count` plants spread over a disc about 1 across, between `heights` high in discs."""
    where = scatter_on_disc(rng, count, 0.0)
    return merge_meshes(
        [
            meshes.transform_mesh(
                plants[rng.integers(len(plants))], at, rng.uniform(*heights), rng.uniform(0, 2 * np.pi)
            )
            for at in where
        ]
    )


def _vary_flower(rng, kind: Kind) -> Flower:
    """The flower of a kind in the colour of one plant."""
    colour = np.array(kind.flower.colour) * rng.uniform(0.9, 1.1)
    if kind.other:
        share = rng.uniform() ** 2
        colour = (1 - share) * colour + share * np.array(kind.other)
    return replace(kind.flower, colour=tuple(np.clip(colour, 0, 0.88)))


def _grow_stems(rng, count: int, lean: float) -> Float[Array, "n 6 3"]:
    root = scatter_roots(rng, count, 0.035)
    tilt = np.radians(lean * np.sqrt(rng.uniform(0.0, 1.0, count)))
    return grow_paths(rng, root, to_direction(tilt, draw_azimuths(rng, count)), rng.uniform(0.72, 1.06, count), 6, 0.07)


def _grow_forks(rng, stems, each: int) -> Float[Array, "n 3 3"]:
    """Branches, `each` per stem from its upper half, that rise nearly as high."""
    share = rng.uniform(0.45, 0.75, (len(stems), each))
    start = sample_paths(stems, share).reshape(-1, 3)
    heading = normalize(np.repeat(path_directions(stems)[:, -1], each, axis=0) + rng.normal(0, 0.45, (len(start), 3)))
    return grow_paths(rng, start, heading, (0.92 - share.reshape(-1)) * rng.uniform(0.6, 1.05, len(start)), 3, 0.08)


def _make_lace(rng, centre, radius: float, green) -> Mesh:
    """Florets on rays, on a shallow dome about the end of a stem."""
    count = 60
    r, turn = radius * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    dome = 0.25 * radius * (1 - (r / radius) ** 2) + rng.normal(0, 0.03 * radius, count)
    at = centre + np.column_stack([r * np.cos(turn), r * np.sin(turn), dome])
    out = to_direction(np.radians(rng.uniform(65, 95, count)), rng.uniform(0, 2 * np.pi, count)) * 0.15 * radius
    side = normalize(np.cross(out, [0, 0, 1.0]))
    tint = LACE * rng.uniform(0.85, 1.05, (count, 1))
    florets = make_blades(np.stack([at - out, at + out], axis=1), side, [0.12 * radius, 0.12 * radius], tint[:, None])
    below = np.tile(centre - [0, 0, 0.45 * radius], (14, 1))
    rays = make_rods(np.stack([below, at[:14] - [0, 0, 0.02 * radius]], axis=1), 0.0025, 0.0015, green, rng)
    return merge_meshes([florets, rays])
