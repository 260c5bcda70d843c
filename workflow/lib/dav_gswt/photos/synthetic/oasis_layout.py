"""Where an oasis has sand, meadow, boulders and a path, and where its shrubs and single boulders stand.

Rasters over a repeating square of side PERIOD, as in `scattering`. The exemplar has one large patch of meadow and one
boulder field, on opposite sides of a path that winds through it; beyond it, noise alone decides.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from dav_gswt.photos.synthetic import noise
from dav_gswt.photos.synthetic.land import smoothstep
from dav_gswt.photos.synthetic.scattering import PERIOD

SAND, MEADOW, BOULDERS, PATH = range(1, 5)
MATERIALS = {"sand": SAND, "meadow": MEADOW, "boulders": BOULDERS, "path": PATH}
WAVES = 7  # of the winding path, over a period
SOFT = 0.11  # half the range of a potential over which a material thins out
WINDING = 0.55  # metres, standard deviation of the path from a straight line
CLEAR = 0.08  # metres between an object and a path, a boulder field or the exemplar's edge
TOUCH = 0.86  # least distance of two stones of a field, in mean sizes
APART = 0.55  # metres between the edges of two objects


@dataclass(frozen=True)
class Layout:
    """Rasters. meadow, boulders, path: 0 (none) to 1 (all), soft at borders. material: numbers of MATERIALS."""

    meadow: Float[Array, "n n"]
    boulders: Float[Array, "n n"]
    path: Float[Array, "n n"]
    material: Int[Array, "n n"]


@dataclass(frozen=True)
class Frame:
    """Coordinates along (u) and across (v) the path, as rasters: x and y, mirrored or exchanged at random."""

    u: Float[Array, "n n"]
    v: Float[Array, "n n"]

    def bump(self, rng: np.random.Generator, u: float, v: float, width: float) -> Float[Array, "n n"]:
        """A Gaussian hill of height 1 about a place that varies a little."""
        du, dv = rng.uniform(-0.3, 0.3, 2)
        return np.exp(-((self.u - u - du) ** 2 + (self.v - v - dv) ** 2) / (2 * width**2))


def draw_layout(rng: np.random.Generator, n: int, exemplar: float, shares: tuple[float, float], half: float) -> Layout:
    """The layout on n x n texels.

    exemplar: side of the square about the origin. shares: of it that are meadow and boulder field. half: half the
    width of the path, metres.
    """
    x, y = ((at + PERIOD / 2) % PERIOD - PERIOD / 2 for at in noise.texel_centres(n, PERIOD))
    inside = np.maximum(np.abs(x), np.abs(y)) <= exemplar / 2
    one, other = rng.choice([-1.0, 1.0], 2)
    frame = Frame(one * y, other * x) if rng.uniform() < 0.5 else Frame(one * x, other * y)

    away = _path_distance(rng, frame) * (1 + 0.22 * noise.make_noise(rng, n, PERIOD, 0.9, 0.12, 0.8))
    path = 1 - smoothstep(0.75 * half, 1.25 * half, away) if half else np.zeros((n, n))
    near = np.exp(-((away / (half + 0.35)) ** 2)) if half else path

    beyond = smoothstep(0.5 * exemplar, 0.5 * exemplar + 1.5, np.maximum(np.abs(x), np.abs(y)))
    meadow = frame.bump(rng, -1.2, 1.25, 1.8) + (0.20 + 0.35 * beyond) * _draw_shapes(rng, n)
    meadow -= _find_level(meadow, inside & (path < 0.5), shares[0] * inside.sum())
    boulders = frame.bump(rng, 1.55, -1.75, 1.3) + (0.16 + 0.25 * beyond) * _draw_shapes(rng, n)
    boulders -= near + smoothstep(-0.2, 0.1, meadow)
    boulders -= _find_level(boulders, inside, shares[1] * inside.sum())

    material = np.full((n, n), SAND)
    for number, where in ((MEADOW, meadow > 0), (BOULDERS, boulders > 0), (PATH, path > 0.5)):
        material[where] = number
    soft = [smoothstep(-SOFT, SOFT, potential) for potential in (meadow, boulders)]
    return Layout(soft[0] * (1 - soft[1]), soft[1], path, material)


def _draw_shapes(rng, n: int) -> Float[Array, "n n"]:
    """Noise whose contours are ragged patches."""
    return noise.make_noise(rng, n, PERIOD, 4.0, 0.11, 1.7)


def _path_distance(rng, frame: Frame) -> Float[Array, "n n"]:
    """The distance to the middle of the path, v = c(u) with c a sum of sines: about |v - c| / sqrt(1 + c'^2)."""
    k = 2 * np.pi / PERIOD * np.arange(1, WAVES + 1)
    size = rng.uniform(0.6, 1.4, WAVES) * np.array([0.5, 0.9, 1.0, 0.6, 0.4, 0.2, 0.15])
    size *= WINDING / np.sqrt((size**2).sum() / 2)
    phase = rng.uniform(0, 2 * np.pi, WAVES)
    u = np.unique(frame.u)
    middle = (size * np.sin(np.outer(u, k) + phase)).sum(axis=1)
    slope = (k * size * np.cos(np.outer(u, k) + phase)).sum(axis=1)
    middle += rng.uniform(-0.25, 0.25) - middle[np.abs(u) < 3].mean()
    column = np.searchsorted(u, frame.u)
    across = np.abs((frame.v - middle[column] + PERIOD / 2) % PERIOD - PERIOD / 2)
    return across / np.sqrt(1 + slope[column] ** 2)


def _find_level(raster: Float[Array, "n n"], where: Array, count: float) -> float:
    """The value that `count` texels of `where` exceed."""
    values = raster[where]
    return float(np.quantile(values, np.clip(1 - count / len(values), 0, 1)))


def scatter_objects(
    rng: np.random.Generator,
    layout: Layout,
    taken: Float[Array, "k 3"],
    counts: tuple[float, float],
    radii: tuple[float, float],
    exemplar: float,
) -> Float[Array, "n 3"]:
    """x, y and radius of objects that stand well apart on sand and meadow, those in the exemplar first.

    None reaches over the edge of the exemplar. taken: of objects that stand already. counts: how many stand in the
    exemplar, and how many around it in a square twice as wide. An object for which 200 tries find no place is left out.
    """
    found, blocked = np.zeros((0, 3)), np.maximum(layout.boulders, layout.path)
    for count, inner, outer in ((counts[0], 0.0, exemplar / 2), (counts[1], exemplar / 2, exemplar)):
        for _ in range(round(count)):
            radius = rng.uniform(*radii)
            for place in rng.uniform(-outer, outer, (200, 2)):
                reach = np.abs(place).max()
                if reach - radius - CLEAR < inner > 0 or reach + radius + CLEAR > outer:
                    continue
                others = np.vstack([taken, found])
                apart = np.hypot(*(others[:, :2] - place).T) - others[:, 2] - radius
                if (apart > APART).all() and _is_open(blocked, place, radius):
                    found = np.vstack([found, [*place, radius]])
                    break
    return found


def _is_open(blocked: Float[Array, "n n"], place: Float[Array, "2"], radius: float) -> bool:
    """Whether a disc and its surroundings are clear."""
    turn = 2 * np.pi * np.arange(16) / 16
    ring = (radius + CLEAR) * np.column_stack([np.cos(turn), np.sin(turn)])
    x, y = (place + np.vstack([[0, 0], 0.5 * ring, ring])).T
    return bool((noise.sample_raster(blocked, PERIOD, x, y) < 0.3).all())


def scatter_touching(
    rng: np.random.Generator,
    sizes: Float[Array, "n"],
    density: Float[Array, "c c"],
    square: tuple[float, float],
    taken: Float[Array, "k 3"],
) -> Float[Array, "m 3"]:
    """x, y and size of stones that may touch but hardly overlap, large ones first, also not those `taken`.

    density: the chance that a stone stays at a place, 0 to 1. square: half the sides of the square in which they lie,
    and of one within it where none do. A stone without a place in 8 tries is left out.
    """
    reach, hole = square
    placed, count = np.vstack([taken, np.zeros((len(sizes), 3))]), len(taken)
    for size in np.sort(sizes)[::-1]:
        tries = rng.uniform(-reach, reach, (8, 2))
        kept = rng.uniform(size=8) < noise.sample_raster(density, PERIOD, *tries.T)
        for place in tries[kept & (np.abs(tries).max(axis=1) >= hole)]:
            others = placed[:count]
            if (np.hypot(*(others[:, :2] - place).T) > TOUCH * (others[:, 2] + size) / 2).all():
                placed[count] = *place, size
                count += 1
                break
    return placed[len(taken) : count]


def cover_circles(n: int, circles: Float[Array, "k 3"]) -> Float[Array, "n n"]:
    """1 within circles (x, y, radius), 0 beyond 1.2 radii, on n x n texels."""
    covered = np.zeros((n, n))
    for x, y, radius in circles:
        at = [
            np.arange(np.floor((v - 1.2 * radius) * n / PERIOD), np.ceil((v + 1.2 * radius) * n / PERIOD))
            for v in (y, x)
        ]
        rows, columns = np.meshgrid(*at, indexing="ij")
        away = np.hypot((columns + 0.5) * PERIOD / n - x, (rows + 0.5) * PERIOD / n - y)
        where = rows.astype(int) % n, columns.astype(int) % n
        covered[where] = np.maximum(covered[where], 1 - smoothstep(radius, 1.2 * radius, away))
    return covered
