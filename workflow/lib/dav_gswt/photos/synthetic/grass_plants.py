"""Tall wild grass as coloured meshes: stands, trodden grass, tussocks, and stems with ears of several kinds.

As in `meshes`: about 1 high (stands: about 1 across), root at the origin, one colour per face. Stands and trodden grass
lean towards +x, so that their yaw is the direction of the lean.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

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

LUSH = np.array([[0.125, 0.255, 0.06], [0.165, 0.30, 0.065], [0.10, 0.21, 0.07]])
FRESH = np.array([[0.28, 0.37, 0.07], [0.34, 0.40, 0.10], [0.22, 0.33, 0.065]])
BLUE = np.array([[0.18, 0.275, 0.15], [0.22, 0.31, 0.175], [0.15, 0.235, 0.115]])
STRAW = np.array([[0.52, 0.42, 0.20], [0.45, 0.36, 0.175], [0.58, 0.49, 0.27]])
RIPE = np.array([[0.54, 0.43, 0.24], [0.47, 0.38, 0.20], [0.60, 0.52, 0.33]])
PURPLE = np.array([[0.34, 0.20, 0.185], [0.40, 0.255, 0.20], [0.29, 0.19, 0.155]])
TIP = 0.001  # half width of a blade's end, as a share of its plant


@dataclass(frozen=True)
class Tint:
    """Colours of grass. green: of living blades. dry: share of blades that are straw."""

    green: Float[Array, "k 3"]
    dry: float


TINTS = (Tint(LUSH, 0.10), Tint(FRESH, 0.22), Tint(BLUE, 0.16), Tint(STRAW, 0.35))


def make_stand(rng: np.random.Generator, count: int, length: float, width: float, tint: Tint) -> Mesh:
    """Upright grass on a disc about 1 across: `count` blades about `length` long, half `width` wide, bent towards +x.

    A third of the blades are short and fill the bottom of the sward.
    """
    root = scatter_on_disc(rng, count, 0.06 * length)
    low = rng.uniform(size=count) < 0.35
    long = length * np.where(low, rng.uniform(0.25, 0.6, count), rng.uniform(0.6, 1.2, count))
    lean = np.radians(np.where(low, rng.uniform(5, 60, count), rng.uniform(2, 26, count)))
    heading = normalize(to_direction(lean, rng.uniform(0, 2 * np.pi, count)) + [0.22, 0, 0])
    paths = grow_paths(rng, root, heading, long, joints=5, bend=0.07, droop=0.12) + _sweep(long)
    return _make_grass_blades(rng, paths, width * np.array([0.8, 1.0, 0.9, 0.6, 0.1]), tint, (0.6, 1.5))


def make_flat_grass(rng: np.random.Generator, count: int, length: float, width: float, tint: Tint) -> Mesh:
    """Trodden grass on a disc about 1 across: blades on top of each other, most of them towards +x."""
    root = scatter_on_disc(rng, count, 0.06 * (0.3 * length))
    heading = to_direction(np.radians(rng.uniform(60, 88, count)), rng.normal(0, 0.55, count))
    paths = grow_paths(rng, root, heading, length * rng.uniform(0.5, 1.2, count), joints=5, bend=0.10, droop=0.10)
    paths[..., 2] = np.abs(paths[..., 2]) * 0.6 + rng.uniform(0, 0.05 * length, (count, 1))
    paths[:, 0, 2] = -0.03 * length
    return _make_grass_blades(rng, paths, width * np.array([0.8, 1.0, 0.9, 0.6, 0.1]), tint, (0.85, 1.1))


def make_tussock(rng: np.random.Generator, tint: Tint) -> Mesh:
    """A tussock: many blades from one place that rise, arch over and hang to the ground."""
    count = int(rng.integers(260, 380))
    root = scatter_roots(rng, count, 0.085, 0.05)
    out = np.arctan2(root[:, 1], root[:, 0]) + rng.normal(0, 0.5, count)
    lean = np.radians(np.abs(rng.normal(0, 24, count)) + 160 * np.hypot(root[:, 0], root[:, 1]))
    paths = grow_paths(
        rng, root, to_direction(lean, out), rng.uniform(0.55, 1.3, count), joints=8, bend=0.06, droop=0.15
    )
    taper = 0.0085 * np.array([0.9, 1.0, 1.0, 0.9, 0.8, 0.6, 0.4, 0.1])
    return _make_grass_blades(rng, paths, taper, tint, (0.35, 1.25))


def make_foxtail(rng: np.random.Generator) -> Mesh:
    """Stems with one dense, narrow, bristly spike each."""
    stems, straw = _grow_stems(rng, 5, 10), mix_palette(rng, RIPE)
    spike = sample_paths(stems, np.linspace(0.84, 1.0, 4)[None].repeat(len(stems), 0))
    bristles = _make_spikelets(rng, spike, 46, straw, (0.022, 0.04), 0.35)
    return merge_meshes(
        [make_rods(stems, 0.0042, 0.003, _stalk_colour(rng, straw), rng), bristles, _make_low_blades(rng, FRESH)]
    )


def make_oat(rng: np.random.Generator) -> Mesh:
    """Stems with loose, nodding ears whose grains hang on fine branches."""
    stems, straw = _grow_stems(rng, 3, 7), mix_palette(rng, RIPE)
    branches = _grow_branches(rng, stems, 11, (0.64, 1.0), (0.08, 0.17), droop=0.42)
    grains = _make_spikelets(rng, branches[:, -2:], 4, straw, (0.020, 0.030), 0.5)
    fine = make_rods(branches, 0.0018, 0.0012, straw, rng)
    return merge_meshes(
        [make_rods(stems, 0.004, 0.0025, _stalk_colour(rng, straw), rng), fine, grains, _make_low_blades(rng, FRESH)]
    )


def make_haze(rng: np.random.Generator) -> Mesh:
    """Stems with a wide, fine, purplish plume."""
    stems, purple = _grow_stems(rng, 5, 9), mix_palette(rng, PURPLE)
    branches = _grow_branches(rng, stems, 16, (0.66, 0.98), (0.06, 0.15), droop=-0.10)
    grains = _make_spikelets(rng, branches, 8, purple, (0.009, 0.016), 0.7)
    parts = [
        make_rods(stems, 0.0035, 0.002, _stalk_colour(rng, purple), rng),
        make_rods(branches, 0.0010, 0.0007, purple, rng),
    ]
    return merge_meshes([*parts, grains, _make_low_blades(rng, LUSH)])


def make_dock(rng: np.random.Generator) -> Mesh:
    """Dock in seed: a few stiff rusty stems with seeds along their upper half, above broad leaves."""
    stems = grow_paths(
        rng,
        scatter_roots(rng, 3, 0.02),
        to_direction(np.radians([4, 14, 11]), draw_azimuths(rng, 3)),
        np.ones(3),
        6,
        0.04,
    )
    rust = np.array([0.25, 0.095, 0.045]) * rng.uniform(0.8, 1.25)
    side = _grow_branches(rng, stems, 6, (0.4, 0.85), (0.16, 0.30), droop=-0.25)
    tops = sample_paths(stems, np.linspace(0.45, 1.0, 5)[None].repeat(3, 0))
    seeds = [
        _make_spikelets(rng, tops, 90, rust, (0.022, 0.04), 0.8),
        _make_spikelets(rng, side, 36, rust, (0.02, 0.036), 0.8),
    ]
    lean, long = np.radians(rng.uniform(25, 65, 9)), rng.uniform(0.3, 0.55, 9)
    out = grow_paths(
        rng,
        scatter_roots(rng, 9, 0.02),
        to_direction(lean, draw_azimuths(rng, 9)),
        long,
        6,
        0.06,
        droop=0.18,
    )
    leaves = _make_grass_blades(rng, out, np.array([0.006, 0.03, 0.05, 0.045, 0.03, TIP]), Tint(LUSH, 0.15), (0.8, 1.1))
    return merge_meshes([make_rods(stems, 0.009, 0.005, 0.8 * rust, rng), *seeds, leaves])


EARS: tuple[Callable[[np.random.Generator], Mesh], ...] = (make_foxtail, make_oat, make_haze)


def _sweep(long) -> Float[Array, "n 5 3"]:
    """Displacement of the joints of blades of these lengths towards +x and down, growing towards the tip."""
    share = np.linspace(0, 1, 5) ** 2
    return 0.16 * long[:, None, None] * share[None, :, None] * np.array([1.0, 0.0, -0.35])


def _grow_stems(rng, fewest: int, most: int) -> Float[Array, "n 7 3"]:
    """Nearly upright stems from one root."""
    count = int(rng.integers(fewest, most))
    lean = np.radians(rng.uniform(1, 15, count))
    height = rng.uniform(0.78, 1.08, count)
    return grow_paths(
        rng,
        scatter_roots(rng, count, 0.05),
        to_direction(lean, draw_azimuths(rng, count)),
        height,
        7,
        0.04,
        droop=0.03,
    )


def _stalk_colour(rng, ear):
    """The colour of a stem: between that of its ear and green."""
    return 0.55 * ear + 0.45 * mix_palette(rng, FRESH)


def _grow_branches(rng, stems, each: int, place, lengths, droop: float) -> Float[Array, "n 4 3"]:
    """Fine branches, `each` per stem at shares `place` of it, the longer the lower."""
    share = rng.uniform(*place, (len(stems), each))
    start = sample_paths(stems, share).reshape(-1, 3)
    lower = ((place[1] - share) / (place[1] - place[0])).reshape(-1)
    turn = rng.uniform(0, 2 * np.pi, len(start))
    long = lengths[0] + (lengths[1] - lengths[0]) * lower * rng.uniform(0.6, 1.1, len(start))
    return grow_paths(rng, start, to_direction(np.radians(rng.uniform(25, 65, len(start))), turn), long, 4, 0.10, droop)


def _make_spikelets(rng, twigs, each: int, colour, lengths, spread: float) -> Mesh:
    """Rhombic husks, `each` per twig, pointing along it with a deviation of `spread`."""
    n = len(twigs) * each
    share = rng.uniform(0.0, 1.0, (len(twigs), each))
    base = sample_paths(twigs, share).reshape(-1, 3)
    ahead = np.repeat(path_directions(twigs)[:, -1], each, axis=0)
    ahead = normalize(ahead + rng.normal(0, spread, (n, 3))) * rng.uniform(*lengths, (n, 1))
    side = normalize(np.cross(ahead, rng.normal(0, 1, (n, 3))))
    paths = np.stack([base, base + 0.45 * ahead, base + ahead], axis=1)
    tint = colour * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.94, 1.06, (n, 3))
    wide = 0.19 * float(np.mean(lengths))
    return make_blades(paths, side, [0.2 * wide, wide, 0.1 * wide], np.clip(tint[:, None].repeat(2, 1), 0.01, 0.95))


def _make_low_blades(rng, green) -> Mesh:
    """Some blades about the root of a stem."""
    count = 14
    heading = to_direction(np.radians(rng.uniform(8, 50, count)), draw_azimuths(rng, count))
    paths = grow_paths(
        rng, scatter_roots(rng, count, 0.05), heading, rng.uniform(0.3, 0.65, count), 5, 0.08, droop=0.16
    )
    return _make_grass_blades(rng, paths, np.array([0.005, 0.006, 0.0055, 0.004, TIP]), Tint(green, 0.2), (0.5, 1.15))


def _make_grass_blades(rng, paths, width, tint: Tint, light: tuple[float, float]) -> Mesh:
    """Blades of grass along paths. light: factor of the colour at root and tip."""
    n, joints = paths.shape[:2]
    side = normalize(np.cross(path_directions(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    green = mix_palette(rng, tint.green) * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    straw = mix_palette(rng, STRAW) * rng.uniform(0.6, 1.15, (n, 1))
    colour = np.where(rng.uniform(size=(n, 1)) < tint.dry, straw, green)
    ripening = np.linspace(0, 1, joints - 1)[None, :, None] ** 3 * rng.uniform(0, 0.35, (n, 1, 1))
    shade = np.linspace(*light, joints - 1)[None, :, None]
    colours = (colour[:, None] * (1 - ripening) + straw[:, None] * ripening) * shade
    return make_blades(paths, side, list(width), np.clip(colours, 0.01, 0.95))
