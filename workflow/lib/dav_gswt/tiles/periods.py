"""Regular ground: rows, courses and bays of an exemplar, and the exemplar turned so that tiles are whole periods.

A pattern with the wave vectors w_1 (rows) or w_1, w_2 (courses of bricks) goes on across every cut and every border
where all moves of patches d, and a tile's sides, are whole numbers of waves: w_k . d = 0, 1, 2, ... Patches keep to it
if only such places are admitted. A tile's side does if the exemplar is turned and stretched a little, by a linear map A
with w_k A = n_k / side, n_k whole numbers: no row need run along the tile, so a turn of a few degrees is enough.

Waves are lines of the power spectrum (the transform of the autocorrelation) far above what is around them. Ripples of
sand and lines of mowing on a part of the ground are no lines: their phase does not last from one part to the next.
"""

from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array
from scipy.ndimage import map_coordinates, maximum_filter, uniform_filter

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.lod.store import Levels
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground

FEWEST, SHORTEST = 5.0, 4.0  # periods in the exemplar, and cells in a period, at least
AROUND = 7  # bins of the spectrum on each side that a line is compared with
RISE = 40.0  # times the power around: noise reaches 10 to 15 somewhere in a spectrum
PARTS = 3  # parts of the exemplar along each side, in which a line is followed
STEADY = 0.75  # of a line's mean power in the parts that is left in the mean of their amplitudes
SHARE, VISIBLE = 1e-3, 0.02  # of the colours' variance that a line, and all of them, explain at least
FAINTEST = (1 / 255) ** 2  # variance that they explain at least: else nobody sees them
LINES = 16  # of the spectrum, the strongest
ALIKE = 0.9  # correlation of the pattern with itself, moved by a period
APART = 0.75  # bins that a line may lie from a whole number of waves
SLANT = 0.3  # sine of the angle between two periods, at least
MOST_CHANGED = 0.2  # norm of A - 1, at most: a turn by 11 degrees, or a fifth of stretch
IN_PHASE = 1 / 32  # of a period that patches may be off
PHASE_COST = 1.5  # of a period that the least places are off, where the norm of the exemplar's change costs 1
LEAST_PLACES = 24  # places of a patch that are admitted in any case


@dataclass(frozen=True)
class Pattern:
    """Periods of an exemplar, and what makes tiles whole numbers of them.

    Attributes:
        waves: wave vectors (east, north) in the exemplar as it is, cycles per cell.
        counts: of each, waves along a tile to the east and to the north.
        side: of a tile, in cells.
        turn: A, from positions in the turned exemplar to those in the exemplar, about its middle.
        cells: side of the turned exemplar.
        cost: what the exemplar is changed by, as the norm of A - 1, and how far patches may be out of phase.
    """

    waves: Float[Array, "k 2"]
    counts: Int[Array, "k 2"]
    side: int
    turn: Float[Array, "2 2"]
    cells: int
    cost: float

    def describe(self) -> dict[str, Any]:
        """The JSON object in seams.json."""
        return {name: getattr(self, name).tolist() for name in ("waves", "counts", "turn")}

    def measure_phases(self, moves: Int[Array, "n 2"]) -> Float[Array, "n"]:
        """How far moves (x, y) are from whole numbers of waves, in periods."""
        phase = moves @ (self.counts / self.side).T
        return np.abs(phase - np.rint(phase)).max(1)

    def admit(self, places: Int[Array, "n 2"], move: Int[Array, "2"]) -> Int[Array, "m 2"]:
        """The places (x, y) of the turned exemplar that are in phase after a move."""
        off = self.measure_phases(places + move)
        return places[off <= max(IN_PHASE, np.sort(off)[:LEAST_PLACES][-1])]


@dataclass(frozen=True)
class _Line:
    """A line of the spectrum. share: of the colours' variance."""

    wave: Float[Array, "2"]
    steady: float
    share: float


def find_waves(colour: Float[Array, "m m c"]) -> Float[Array, "k 2"]:
    """Wave vectors (east, north; cycles per cell) of a map's pattern: of none, one or two periods. NaN: not known."""
    known, values = np.isfinite(colour), np.nan_to_num(colour).astype(float)
    values = np.where(known, values - values.sum((0, 1)) / np.maximum(known.sum((0, 1)), 1), 0)
    lines = _find_lines(values)
    share = sum(line.share for line in lines)
    seen = share >= VISIBLE and share * values.var((0, 1)).sum() >= FAINTEST
    return _find_generators(lines, len(values)) if seen else np.zeros((0, 2))


def _find_lines(values: Float[Array, "m m c"]) -> list[_Line]:
    """The lines of a map's spectrum that are strong and steady."""
    m = len(values)
    window = np.hanning(m + 1)[:m]
    power = (np.abs(np.fft.fft2(values * (window[:, None] * window)[..., None], axes=(0, 1))) ** 2).sum(-1)
    tiny = np.finfo(float).tiny
    around = np.exp(uniform_filter(np.log(power + tiny), 2 * AROUND + 1, mode="wrap") + np.euler_gamma)
    rise = power / np.maximum(around, np.finfo(float).eps ** 2 * power.max() + tiny)
    frequency = np.fft.fftfreq(m)
    length = np.hypot(frequency[:, None], frequency)
    upper = (frequency[:, None] > 0) | ((frequency[:, None] == 0) & (frequency > 0))
    strong = (rise > RISE) & (rise == maximum_filter(rise, 5, mode="wrap"))
    rows, columns = np.nonzero(strong & upper & (length >= FEWEST / m) & (length <= 1 / SHORTEST))
    best = np.argsort(-rise[rows, columns], kind="stable")[:LINES]
    starts = np.stack([frequency[columns[best]], frequency[rows[best]]], 1)
    lines = [_follow_line(values, start) for start in starts]
    return [line for line in lines if line.steady >= STEADY and line.share >= SHARE]


def _follow_line(values: Float[Array, "m m c"], wave: Float[Array, "2"]) -> _Line:
    """A line near a wave vector, which is refined until the phase is the same, on average, in neighbouring parts."""
    part = len(values) // PARTS
    at = np.arange(part * PARTS)
    window = np.kron(np.eye(PARTS), np.hanning(part + 1)[:part] * 2 / part)
    seen = values[: len(at), : len(at)]
    parts = np.zeros((PARTS, PARTS, values.shape[-1]), complex)
    for _ in range(4):
        east, north = (window * np.exp(-2j * np.pi * cycles * at) for cycles in wave)
        parts = np.einsum("qx,pxc->pqc", east, np.einsum("py,yxc->pxc", north, seen))
        pairs = (parts[:, :-1], parts[:, 1:]), (parts[:-1], parts[1:])
        wave = wave + [np.angle((b * a.conj()).sum()) / (2 * np.pi * part) for a, b in pairs]
    kept, power = ((np.abs(each) ** 2).sum() for each in (parts.mean((0, 1)), parts / PARTS))
    return _Line(wave, float(kept / power), float(2 * kept / seen.var((0, 1)).sum()))


def _find_generators(lines: list[_Line], cells: int) -> Float[Array, "k 2"]:
    """The longest waves of which all lines are whole numbers: one if the lines are parallel, or else two.

    They belong to the shortest periods by which the lines' autocorrelation repeats. Where the lines have no such
    periods, those parallel to the strongest have.
    """
    waves, weights = np.stack([line.wave for line in lines]), np.sqrt([line.share for line in lines])
    way = waves[np.argmax(weights)]
    way = way / np.linalg.norm(way)
    near = APART / cells
    parallel = np.abs(waves @ [-way[1], way[0]]) < near
    reach = np.arange(-(cells // FEWEST) - 1, cells // FEWEST + 2)
    if not parallel.all():
        lags = np.stack(np.meshgrid(reach, reach[reach >= 0]), -1).reshape(-1, 2)
        periods = _find_periods(waves, weights, lags)
        across = periods @ [-periods[0, 1], periods[0, 0]] if len(periods) else np.zeros(0)
        size = np.linalg.norm(periods, axis=1)
        apart = np.flatnonzero(np.abs(across) > SLANT * size * size[:1])
        if len(apart):
            made = _fit_generators(waves, weights, waves @ periods[[0, apart[0]]].T, near)
            if np.linalg.matrix_rank(made, tol=near) == 2:
                return made
    along = waves[parallel] @ way
    period = _find_periods(along[:, None], weights[parallel], reach[reach > 0, None])[:1]
    if not len(period):  # lines of several patterns: the strongest counts
        return waves[[np.argmax(weights)]]
    return _fit_generators(waves[parallel], weights[parallel], along[:, None] @ period, near)


def _find_periods(waves: Float[Array, "n d"], weights: Float[Array, "n"], lags: Float[Array, "m d"]):
    """The periods near some lags, the shortest first: by them the sum of the waves is ALIKE."""
    near = np.cos(2 * np.pi * lags @ waves.T) @ weights >= 0.5 * weights.sum()
    exact = np.rint(lags[near] @ waves.T) * weights @ np.linalg.pinv(waves * weights[:, None]).T
    alike = np.cos(2 * np.pi * exact @ waves.T) @ weights >= ALIKE * weights.sum()
    size = np.linalg.norm(exact, axis=1)
    kept = exact[alike & (size >= SHORTEST / 2)]
    return kept[np.argsort(np.linalg.norm(kept, axis=1), kind="stable")]


def _fit_generators(waves: Array, weights: Array, counts: Float[Array, "n k"], reach: float) -> Float[Array, "k 2"]:
    """Generators by least squares, from the waves and how many of each they are, without those that lie apart."""
    counts, generators = np.rint(counts), np.zeros((counts.shape[1], 2))
    for _ in range(3):
        generators = np.linalg.pinv(counts * weights[:, None]) @ (waves * weights[:, None])
        fits = np.linalg.norm(counts @ generators - waves, axis=1) < reach
        weights = weights * (fits if fits.any() else 1)
    return generators


def describe_rows(waves: Float[Array, "k 2"], spacing: float, unit: str = "") -> str:
    """The periods of waves in world units, and the directions that their rows run in, in words."""
    degrees = (np.degrees(np.arctan2(waves[:, 1], waves[:, 0])) + 90) % 180
    periods = spacing / np.linalg.norm(waves, axis=1)
    pairs = zip(periods.tolist(), degrees.tolist(), strict=True)
    return " and ".join(f"every {period:.2g}{unit}, {angle:.0f} degrees from east" for period, angle in pairs)


def measure_turn(turn: Float[Array, "2 2"]) -> tuple[float, float]:
    """Angle in degrees, and the largest stretch, that a linear map turns and stretches by."""
    angle = np.degrees(np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1]))
    return float(angle), float(np.abs(np.linalg.svd(turn, compute_uv=False) - 1).max())


def fit_pattern(waves: Float[Array, "k 2"], cells: int, side: int, unit: int, block: int) -> Pattern | None:
    """The pattern in tiles of a side, with the least cost; None if the exemplar would have to be changed too much.

    The numbers of waves along a tile are those on either side of the exact ones.

    cells: the exemplar's side. unit: the turned exemplar is a multiple of it, the largest that the exemplar contains.
    block: patches are placed by.
    """
    found, exact = [], waves * side
    for up in product((0, 1), repeat=exact.size):
        counts = np.floor(exact).astype(int) + np.reshape(up, exact.shape)
        turn = _fit_turn(waves, counts / side)
        changed = float(np.linalg.norm(turn - np.eye(2), 2))
        if changed > MOST_CHANGED or (kept := int(cells / np.abs(turn).sum(1).max() / unit) * unit) < side:
            continue
        pattern = Pattern(waves, counts, side, turn, kept, changed)
        moves = np.arange(0, pattern.cells - side + 1, block)
        moves = np.stack(np.meshgrid(moves, moves), -1).reshape(-1, 2)
        off = pattern.measure_phases(moves)
        least = np.partition(off, min(LEAST_PLACES, len(off)) - 1)[min(LEAST_PLACES, len(off)) - 1]
        found.append(replace(pattern, cost=changed + PHASE_COST * least))
    return min(found, key=lambda pattern: pattern.cost, default=None)


def _fit_turn(waves: Float[Array, "k 2"], wanted: Float[Array, "k 2"]) -> Float[Array, "2 2"]:
    """The linear map A with waves A = wanted: of one wave, a turn and a scale."""
    if len(waves) == 2:
        return np.linalg.solve(waves, wanted)
    z = np.conj(complex(*wanted[0]) / complex(*waves[0]))
    return np.array([[z.real, -z.imag], [z.imag, z.real]])


def turn_levels(levels: Levels, turn: Float[Array, "2 2"], cells: int) -> Levels:
    """Levels whose exemplar is turned about its middle, `cells` finest cells wide, without a margin."""
    turned = [
        _turn_level(field, grid, turn, cells >> number)
        for number, (field, grid) in enumerate(zip(levels.fields, levels.grids, strict=True))
    ]
    return replace(levels, fields=[field for field, _ in turned], grids=[grid for _, grid in turned])


def _turn_level(
    field: GaussianField, grid: Ground, turn: Float[Array, "2 2"], cells: int
) -> tuple[GaussianField, Ground]:
    """One level. Colours and heights of the ground are sampled by cubic splines; all else of a disc is its cell's."""
    west, south, side = grid.exemplar
    middle = np.array([west + side / 2, south + side / 2])
    west, south = (middle - cells * grid.spacing / 2).tolist()
    at = (np.arange(cells) + 0.5 - cells / 2) * grid.spacing
    x, y = np.moveaxis(np.stack(np.meshgrid(at, at), -1) @ turn.T + middle, -1, 0)
    row, column = (y - grid.south) / grid.spacing - 0.5, (x - grid.west) / grid.spacing - 0.5

    def sample(values: Float[Array, "..."]) -> Float[Array, "m m"]:
        return map_coordinates(values.reshape(grid.shape).astype(float), [row, column], order=3, mode="nearest")

    nearest = tuple(np.clip(np.rint(v).astype(int), 0, n - 1) for v, n in zip((row, column), grid.shape, strict=True))
    made = Ground(west, south, grid.spacing, 0, 0, cells, sample(grid.heights), grid.seen[nearest])
    parts, standing = [], discs.remove_underlay(field, grid)
    if field.ground.any():
        layer, standing = standing[: grid.heights.size], standing[grid.heights.size :]
        colour = np.stack([sample(channel).ravel() for channel in layer.base_colours.T], 1)
        height = sample(layer.means[:, 2]).ravel()
        ground = _turn_splats(layer[np.ravel_multi_index(nearest, grid.shape).ravel()], turn, middle)
        means = np.column_stack([made.centres[:, :2], height]).astype(np.float32)
        parts = [replace(ground, means=means, sh=rgb_to_sh(colour)).with_harmonics(field.sh.shape[1])]
        if (under := discs.find_underlay(field, grid)).stop > under.start:
            parts.append(discs.make_underlay(made, parts[0]))
    standing = _turn_splats(standing, turn, middle)
    size = np.float32(-0.5 * np.log(np.linalg.det(turn)))
    standing = replace(standing, log_scales=standing.log_scales + size)
    return concatenate_fields([*parts, standing[made.contains(standing.means)]]), made


def _turn_splats(field: GaussianField, turn: Float[Array, "2 2"], middle: Float[Array, "2"]) -> GaussianField:
    """Gaussians moved by the inverse of a map, and turned by its rotation; colours that do not depend on the view."""
    means = field.means.astype(float)
    means[:, :2] = (means[:, :2] - middle) @ np.linalg.inv(turn).T + middle
    half = -0.5 * np.radians(measure_turn(turn)[0])
    c, s, (w, x, y, z) = np.cos(half), np.sin(half), field.quats.T.astype(float)
    quats = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 1)
    sh = field.sh.copy()
    sh[:, 1:] = 0
    return replace(field, means=means.astype(np.float32), quats=quats.astype(np.float32), sh=sh)
