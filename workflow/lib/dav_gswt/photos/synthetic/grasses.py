"""Tall wild grass as coloured meshes: stands, grass that lies flat, tussocks, and stems with ears of several kinds.

As the plants of things.py: about 1 high (stands: about 1 across), root at the origin, every face of one colour, colours
linear reflectances. Stands and flat grass lean towards +x, so that their yaw is the way the wind or a foot bent them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.photos.synthetic.meshes import (
    Mesh,
    along,
    around,
    blades,
    direction,
    grown,
    headings,
    merged,
    mixed,
    rods,
    unit,
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
    """The colours of a kind of grass: of its living blades, and the share of blades that are straw."""

    green: Float[Array, "k 3"]
    dry: float


TINTS = (Tint(LUSH, 0.10), Tint(FRESH, 0.22), Tint(BLUE, 0.16), Tint(STRAW, 0.35))


def stand(rng: np.random.Generator, count: int, length: float, width: float, tint: Tint) -> Mesh:
    """Upright grass on a disc about 1 across: `count` blades about `length` long, half `width` wide, bent towards +x.

    A third are short and broad and make the dense bottom of the sward.
    """
    root = _disc(rng, count, length)
    low = rng.uniform(size=count) < 0.35
    long = length * np.where(low, rng.uniform(0.25, 0.6, count), rng.uniform(0.6, 1.2, count))
    lean = np.radians(np.where(low, rng.uniform(5, 60, count), rng.uniform(2, 26, count)))
    heading = unit(direction(lean, rng.uniform(0, 2 * np.pi, count)) + [0.22, 0, 0])
    paths = grown(rng, root, heading, long, joints=5, bend=0.07, droop=0.12) + _swept(long)
    return _coloured(rng, paths, width * np.array([0.8, 1.0, 0.9, 0.6, 0.1]), tint, (0.6, 1.5))


def flat(rng: np.random.Generator, count: int, length: float, width: float, tint: Tint) -> Mesh:
    """Trodden grass on a disc about 1 across: blades that lie one over the other, most of them towards +x."""
    root = _disc(rng, count, 0.3 * length)
    heading = direction(np.radians(rng.uniform(60, 88, count)), rng.normal(0, 0.55, count))
    paths = grown(rng, root, heading, length * rng.uniform(0.5, 1.2, count), joints=5, bend=0.10, droop=0.10)
    paths[..., 2] = np.abs(paths[..., 2]) * 0.6 + rng.uniform(0, 0.05 * length, (count, 1))
    paths[:, 0, 2] = -0.03 * length
    return _coloured(rng, paths, width * np.array([0.8, 1.0, 0.9, 0.6, 0.1]), tint, (0.85, 1.1))


def tussock(rng: np.random.Generator, tint: Tint) -> Mesh:
    """A tussock: very many blades from a small foot that rise, arch over and hang to the ground all around."""
    count = int(rng.integers(260, 380))
    root = np.column_stack([rng.normal(0, 0.085, (count, 2)), np.full(count, -0.05)])
    out = np.arctan2(root[:, 1], root[:, 0]) + rng.normal(0, 0.5, count)
    lean = np.radians(np.abs(rng.normal(0, 24, count)) + 160 * np.hypot(root[:, 0], root[:, 1]))
    paths = grown(rng, root, direction(lean, out), rng.uniform(0.55, 1.3, count), joints=8, bend=0.06, droop=0.15)
    taper = 0.0085 * np.array([0.9, 1.0, 1.0, 0.9, 0.8, 0.6, 0.4, 0.1])
    return _coloured(rng, paths, taper, tint, (0.35, 1.25))


def foxtail(rng: np.random.Generator) -> Mesh:
    """Stems that each carry one dense, narrow, bristly spike."""
    stems, straw = _stems(rng, 5, 10), mixed(rng, RIPE)
    spike = along(stems, np.linspace(0.84, 1.0, 4)[None].repeat(len(stems), 0))
    bristles = _spikelets(rng, spike, 46, straw, (0.022, 0.04), 0.35)
    return merged([rods(stems, 0.0042, 0.003, _stalk(rng, straw), rng), bristles, _low(rng, FRESH)])


def oat(rng: np.random.Generator) -> Mesh:
    """Stems whose loose, nodding ears hang their grains on fine branches to one side."""
    stems, straw = _stems(rng, 3, 7), mixed(rng, RIPE)
    branches = _branches(rng, stems, 11, (0.64, 1.0), (0.08, 0.17), droop=0.42)
    grains = _spikelets(rng, branches[:, -2:], 4, straw, (0.020, 0.030), 0.5)
    fine = rods(branches, 0.0018, 0.0012, straw, rng)
    return merged([rods(stems, 0.004, 0.0025, _stalk(rng, straw), rng), fine, grains, _low(rng, FRESH)])


def haze(rng: np.random.Generator) -> Mesh:
    """Stems with a wide, fine, purplish plume: what makes a reddish haze over a field of ripe grass."""
    stems, purple = _stems(rng, 5, 9), mixed(rng, PURPLE)
    branches = _branches(rng, stems, 16, (0.66, 0.98), (0.06, 0.15), droop=-0.10)
    grains = _spikelets(rng, branches, 8, purple, (0.009, 0.016), 0.7)
    parts = [rods(stems, 0.0035, 0.002, _stalk(rng, purple), rng), rods(branches, 0.0010, 0.0007, purple, rng)]
    return merged([*parts, grains, _low(rng, LUSH)])


def dock(rng: np.random.Generator) -> Mesh:
    """Dock in seed: a few stiff rusty stems, whorled with seeds over their upper half, above broad leaves."""
    stems = grown(rng, _foot(rng, 3, 0.02), direction(np.radians([4, 14, 11]), around(rng, 3)), np.ones(3), 6, 0.04)
    rust = np.array([0.25, 0.095, 0.045]) * rng.uniform(0.8, 1.25)
    side = _branches(rng, stems, 6, (0.4, 0.85), (0.16, 0.30), droop=-0.25)
    tops = along(stems, np.linspace(0.45, 1.0, 5)[None].repeat(3, 0))
    seeds = [_spikelets(rng, tops, 90, rust, (0.022, 0.04), 0.8), _spikelets(rng, side, 36, rust, (0.02, 0.036), 0.8)]
    lean, long = np.radians(rng.uniform(25, 65, 9)), rng.uniform(0.3, 0.55, 9)
    out = grown(rng, _foot(rng, 9, 0.02), direction(lean, around(rng, 9)), long, 6, 0.06, droop=0.18)
    leaves = _coloured(rng, out, np.array([0.006, 0.03, 0.05, 0.045, 0.03, TIP]), Tint(LUSH, 0.15), (0.8, 1.1))
    return merged([rods(stems, 0.009, 0.005, 0.8 * rust, rng), *seeds, leaves])


EARS: tuple[Callable[[np.random.Generator], Mesh], ...] = (foxtail, oat, haze)


def _disc(rng, count: int, length: float) -> Float[Array, "n 3"]:
    """Roots spread evenly over a disc 1 across, a little below the ground."""
    radius, turn = 0.5 * np.sqrt(rng.uniform(size=count)), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(count, -0.06 * length)])


def _foot(rng, count: int, spread: float) -> Float[Array, "n 3"]:
    return np.column_stack([rng.normal(0, spread, (count, 2)), np.full(count, -0.03)])


def _swept(long) -> Float[Array, "n 5 3"]:
    """How far the joints of blades of these lengths are blown towards +x: more, and somewhat down, towards the tip."""
    share = np.linspace(0, 1, 5) ** 2
    return 0.16 * long[:, None, None] * share[None, :, None] * np.array([1.0, 0.0, -0.35])


def _stems(rng, fewest: int, most: int) -> Float[Array, "n 7 3"]:
    """Stems from one root, nearly upright, that nod at the end."""
    count = int(rng.integers(fewest, most))
    lean = np.radians(rng.uniform(1, 15, count))
    height = rng.uniform(0.78, 1.08, count)
    return grown(rng, _foot(rng, count, 0.05), direction(lean, around(rng, count)), height, 7, 0.04, droop=0.03)


def _stalk(rng, ear):
    """A stem's colour: between its ear's and green."""
    return 0.55 * ear + 0.45 * mixed(rng, FRESH)


def _branches(rng, stems, each: int, place, lengths, droop: float) -> Float[Array, "n 4 3"]:
    """Fine branches, `each` on a stem at shares `place` of it, the longer the lower."""
    share = rng.uniform(*place, (len(stems), each))
    start = along(stems, share).reshape(-1, 3)
    lower = ((place[1] - share) / (place[1] - place[0])).reshape(-1)
    turn = rng.uniform(0, 2 * np.pi, len(start))
    long = lengths[0] + (lengths[1] - lengths[0]) * lower * rng.uniform(0.6, 1.1, len(start))
    return grown(rng, start, direction(np.radians(rng.uniform(25, 65, len(start))), turn), long, 4, 0.10, droop)


def _spikelets(rng, twigs, each: int, colour, lengths, spread: float) -> Mesh:
    """Rhombic husks, `each` on a twig all along it, pointing ahead but for `spread`."""
    n = len(twigs) * each
    share = rng.uniform(0.0, 1.0, (len(twigs), each))
    base = along(twigs, share).reshape(-1, 3)
    ahead = np.repeat(headings(twigs)[:, -1], each, axis=0)
    ahead = unit(ahead + rng.normal(0, spread, (n, 3))) * rng.uniform(*lengths, (n, 1))
    side = unit(np.cross(ahead, rng.normal(0, 1, (n, 3))))
    paths = np.stack([base, base + 0.45 * ahead, base + ahead], axis=1)
    tint = colour * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.94, 1.06, (n, 3))
    wide = 0.19 * float(np.mean(lengths))
    return blades(paths, side, [0.2 * wide, wide, 0.1 * wide], np.clip(tint[:, None].repeat(2, 1), 0.01, 0.95))


def _low(rng, green) -> Mesh:
    """Some blades about the root of a stem."""
    count = 14
    heading = direction(np.radians(rng.uniform(8, 50, count)), around(rng, count))
    paths = grown(rng, _foot(rng, count, 0.05), heading, rng.uniform(0.3, 0.65, count), 5, 0.08, droop=0.16)
    return _coloured(rng, paths, np.array([0.005, 0.006, 0.0055, 0.004, TIP]), Tint(green, 0.2), (0.5, 1.15))


def _coloured(rng, paths, width, tint: Tint, light: tuple[float, float]) -> Mesh:
    """Blades of grass along paths, darker at the root than at the tip as `light` says, a share of them straw."""
    n, joints = paths.shape[:2]
    side = unit(np.cross(headings(paths)[:, 0], rng.normal(0, 1, (n, 3))))
    green = mixed(rng, tint.green) * rng.uniform(0.7, 1.25, (n, 1)) * rng.uniform(0.93, 1.07, (n, 3))
    straw = mixed(rng, STRAW) * rng.uniform(0.6, 1.15, (n, 1))
    colour = np.where(rng.uniform(size=(n, 1)) < tint.dry, straw, green)
    ripening = np.linspace(0, 1, joints - 1)[None, :, None] ** 3 * rng.uniform(0, 0.35, (n, 1, 1))
    shade = np.linspace(*light, joints - 1)[None, :, None]
    painted = (colour[:, None] * (1 - ripening) + straw[:, None] * ripening) * shade
    return blades(paths, side, list(width), np.clip(painted, 0.01, 0.95))
