"""What gives a terrain away from above: even brightness, landmarks that return, broken rows, lines at tile borders.

- Spectrum: power of brightness in octaves, terrain over exemplar (`compare_spectra`).
- Landmarks: how far away the nearest copy of the same one is, and how many are shown (`measure_landmarks`).
- Regular ground: autocorrelation at the lags that the exemplar contains, terrain over exemplar (`measure_regularity`).
- Jump: steps of brightness across tile borders over those at all other places (`measure_jump`).

Repetition on a lattice is `lattice.measure_lattice`. Brightness is the mean of the encoded channels. Pictures of
the exemplar show its finest level with its trend, at the terrain's pixel width.
"""

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int, Integer
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt, gaussian_filter, label, map_coordinates, maximum_filter
from scipy.optimize import minimize
from scipy.spatial import cKDTree

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.files import read_json, write_json
from dav_gswt.images import image_files
from dav_gswt.lod.store import Levels
from dav_gswt.reconstruction import top_view
from dav_gswt.terrain import stills, visibility
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.tiles.layout import CENTRE, source_cells
from dav_gswt_study.terrain import lattice

STEPS = 4  # crops of a spectrum overlap by all but one of so many parts
SCALE = 0.4  # of the exemplar's width: what landmarks are measured by (`lattice.SPOT`), about a tile
LEAST = 0.5  # of a round spot's area: smaller components are no landmarks
VISIBLE = 0.5  # of a landmark's area that a copy shows at least
AROUND = 8  # cells around the terrain in which copies are looked for
WIDE = 1 / 8  # of the exemplar's width: blur of what is wider than a period
REGULAR = 0.15  # autocorrelation at the first period of regular ground, at least
LONGEST = 0.25  # of the exemplar's width: a period, at most
TURNS, SIZES = np.radians(np.arange(0, 360, 1.0)), np.linspace(0.85, 1.15, 31)  # of periods that are looked for
ABOVE, WIDTH, SPAN, PLACES = 24.0, 900, 2, 2  # eye floors, pixels, pixels about a border, pictures of jumps
LINES = 200  # random lines beside borders


def picture_exemplar(levels: Levels, side: float, pixels: int) -> Float[Array, "h w"]:
    """Brightness of an exemplar from above, trend included, row 0 in the south; holes take the nearest colour.

    side: of a tile, in world units; `pixels` of it are one tile.
    """
    grid = levels.grids[0]
    colour = top_view.render_exemplar(levels.fields[0], grid).colour_or_nan()
    near = distance_transform_edt(np.isnan(colour[..., 0]), return_distances=False, return_indices=True)
    width = min(grid.cells, round(grid.cells * grid.spacing / side * pixels))
    return image_files.shrink_image(colour[tuple(near)], width, width).astype(float).mean(-1)


def picture_terrain(terrain: EndlessTerrain, pixels: int = lattice.PIXELS, sharp: int = 1) -> Float[Array, "h w 3"]:
    """20 x 20 cells from above, row 0 in the south: the one place where the measures get pictures of a terrain.

    sharp: Gaussians are mostly narrower than a pixel over this.
    """
    level = lattice.choose_level(terrain, sharp * pixels)
    return lattice.render_from_above(terrain, level, pixels=pixels)[::-1].astype(float)


@dataclass(frozen=True)
class Octave:
    """Wavelengths of an octave in tiles, and the power in it: of the terrain over the exemplar's (both ways and their
    geometric mean), and of one half of the exemplar over the other, as far as the exemplar agrees with itself.
    """

    shortest: float
    longest: float
    ways: tuple[float, float]
    ratio: float
    halves: float


def compare_spectra(
    terrains: tuple[Float[Array, "h w"], Float[Array, "h w"]], exemplar: Float[Array, "n n"], pixels: int
) -> list[Octave]:
    """Power of brightness, terrain over exemplar, in octaves from half the exemplar's width down to half a tile.

    The exemplar is parted in a western and an eastern half. terrains: pictures of the terrain with statistics from the
    western half and from the eastern one; each is tested on the *other* half.

    Both sides are treated alike: square crops as wide as half the exemplar, which overlap by three quarters of their
    width; of each a plane is subtracted (what is wider than a crop, such as fall-off, would leak into the widest
    octave) and the rest is weighted by a Hann window; powers are averaged over crops. An octave holds frequencies of
    [2^k, 2^(k + 1)) periods a crop.
    """
    size = len(exemplar) // 2
    halves = [measure_power(half, size) for half in (exemplar[:, :size], exemplar[:, -size:])]
    own = [measure_power(picture, size) for picture in terrains]
    octaves, across = [], size / pixels
    for k in range(int(np.ceil(np.log2(max(across / 0.5, 1)) - 1e-9))):
        west, east = halves[0][k], halves[1][k]
        ways = float(own[0][k] / east), float(own[1][k] / west)
        wave = across / 2**k
        octaves.append(Octave(wave / 2, wave, ways, float(np.sqrt(np.prod(ways))), float(west / east)))
    return octaves


def measure_power(picture: Float[Array, "h w"], size: int) -> Float[Array, "k"]:
    """Mean power in octaves of square crops (`compare_spectra`), the widest octave first. size: of a crop, pixels."""
    y, x = (v.ravel() for v in np.mgrid[:size, :size])
    base = np.linalg.qr(np.stack([np.ones(size**2), x, y], 1))[0]
    hann = np.sin(np.pi * (np.arange(size) + 0.5) / size) ** 2
    periods = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.fftfreq(size))) * size
    octave = np.floor(np.log2(np.maximum(periods, 0.5))).astype(int) + 1
    starts = [range(0, n - size + 1, max(1, size // STEPS)) for n in picture.shape]
    powers = []
    for row, column in ((r, c) for r in starts[0] for c in starts[1]):
        crop = picture[row : row + size, column : column + size].ravel()
        rest = (crop - base @ (base.T @ crop)).reshape(size, size) * np.outer(hann, hann)
        powers.append(np.bincount(octave.ravel(), (np.abs(np.fft.fft2(rest)) ** 2).ravel())[1:])
    return np.mean(powers, 0)


@dataclass(frozen=True)
class Landmarks:
    """What stands out of an exemplar. digest: of its brightness. numbers: [y, x], row 0 in the south: which landmark
    a cell is of, from 1; 0: none."""

    digest: str
    numbers: Int[Array, "m m"]

    @property
    def areas(self) -> Int[Array, "k"]:
        return np.bincount(self.numbers.ravel())[1:]

    @property
    def middles(self) -> Float[Array, "k 2"]:
        """Mean cell (x, y) of each."""
        cells, many = self.numbers.ravel(), self.areas
        y, x = (v.ravel() + 0.5 for v in np.mgrid[: len(self.numbers), : len(self.numbers)])
        return np.stack([np.bincount(cells, v)[1:] / many for v in (x, y)], 1)


def find_landmarks(levels: Levels) -> Landmarks:
    """The landmarks of an exemplar, from it alone: connected places whose band-passed brightness stands out
    (`lattice.find_landmarks` with SCALE of the exemplar as a tile), with LEAST of a spot's area at least."""
    grid = levels.grids[0]
    bright = picture_exemplar(levels, grid.cells * grid.spacing, grid.cells)
    numbers, _ = label(lattice.find_landmarks(bright, round(SCALE * grid.cells)))
    small = np.bincount(numbers.ravel()) < LEAST * np.pi * (lattice.SPOT * SCALE * grid.cells) ** 2
    small[0] = True
    kept = np.where(small, 0, np.cumsum(~small))
    return Landmarks(_digest(bright), kept[numbers])


def _digest(bright: Float[Array, "m m"]) -> str:
    """Of brightness in steps of 1/255: rendering on other machines moves last bits."""
    return hashlib.sha256(np.rint(255 * bright).astype(np.uint8).tobytes()).hexdigest()[:16]


def write_landmarks(marks: list[Landmarks], path: Path | str) -> None:
    """Write the landmarks of each material's exemplar as JSON: runs of cells, row by row from the south."""
    out = []
    for own in marks:
        first = np.flatnonzero(np.diff(own.numbers.ravel(), prepend=-1))
        runs = {"first": first.tolist(), "numbers": own.numbers.ravel()[first].tolist()}
        out.append({"digest": own.digest, "cells": len(own.numbers)} | runs)
    write_json(path, out)


def read_landmarks(path: Path | str, sets: list[Levels]) -> list[Landmarks]:
    """Read what `write_landmarks` wrote for these exemplars. Raises: InputError: the file is of other exemplars."""
    marks = []
    for own, levels in zip(read_json(path), sets, strict=True):
        size = own["cells"]
        numbers = np.repeat(own["numbers"], np.diff([*own["first"], size**2])).reshape(size, size)
        marks.append(Landmarks(own["digest"], numbers))
        if own["digest"] != find_landmarks(levels).digest:
            raise InputError(f"{path}: made of another exemplar; delete the file and find the landmarks again")
    return marks


@dataclass(frozen=True)
class LandmarkMeasures:
    """count: landmarks of the exemplar. distance: from a copy to the nearest of the same landmark, in tiles, the median
    over copies; NaN without copies. shown: share of the landmarks' area that the terrain shows. in_strips: share of
    the copies most of which lies in strips and corners. copies: on the terrain.
    """

    count: int
    distance: float
    shown: float
    in_strips: float
    copies: int


def measure_landmarks(
    marks: Landmarks,
    labels: Integer[Array, "tiles n n"],
    shifts: Int[Array, "tiles 9 2"],
    chosen: Int[Array, "rows columns"],
) -> LandmarkMeasures:
    """Copies of landmarks on a terrain of one material.

    A copy is a landmark in one place of the terrain, of which VISIBLE of its area can be seen, over tile borders, too.
    Its nearest one may lie up to AROUND cells beyond the terrain.

    Args:   labels, shifts: of the tile set. chosen: tile numbers, row 0 in the south, of the cells of the terrain and
    AROUND of them on each side.
    """
    n, kinds = labels.shape[1], shifts.shape[1]
    shown, parts = np.zeros(marks.numbers.shape, bool), {}
    for tile in np.unique(chosen).tolist():
        cells = source_cells(labels[tile], shifts[tile])
        shown[cells] = True
        own = marks.numbers[cells].astype(int) * kinds + labels[tile]
        key, many = np.unique(own[own >= kinds], return_counts=True)
        parts[tile] = np.stack([key // kinds, key % kinds, many], 1)
    rows = []
    for (j, i), tile in np.ndenumerate(chosen):
        part = parts[tile]
        origin = np.array([i, j]) * n - shifts[tile][part[:, 1]]
        rows.append(np.concatenate([part[:, :1], origin, part[:, 2:], part[:, 2:] * (part[:, 1:2] == CENTRE)], 1))
    table = np.concatenate(rows)
    places, at = np.unique(table[:, :3], axis=0, return_inverse=True)
    area, central = (np.bincount(at.ravel(), table[:, k], len(places)) for k in (3, 4))
    which = places[:, 0] - 1
    seen = area >= VISIBLE * marks.areas[which]
    where = ((places[:, 1:] + marks.middles[which]) / n)[seen]
    inside = ((where >= AROUND) & (where < np.array(chosen.shape)[::-1] - AROUND)).all(1)
    nearest = np.full(len(where), np.inf)
    for number in np.unique(which[seen]):
        mine = which[seen] == number
        nearest[mine] = np.asarray(cKDTree(where[mine]).query(where[mine], 2)[0])[:, 1]
    total = max(int(marks.areas.sum()), 1)
    return LandmarkMeasures(
        len(marks.areas),
        float(np.median(nearest[inside])) if inside.any() else float("nan"),
        float((shown & (marks.numbers > 0)).sum() / total),
        float((central < 0.5 * area)[seen][inside].mean()) if inside.any() else float("nan"),
        int(inside.sum()),
    )


def choose_around(terrain: EndlessTerrain, tiles: int = lattice.TILES) -> Int[Array, "rows columns"]:
    """The tiles of `tiles` x `tiles` cells and of AROUND cells on each side."""
    steps = np.arange(-AROUND, tiles + AROUND)
    i, j = (v.ravel() for v in np.meshgrid(steps, steps))
    return visibility.choose_tiles(terrain, i, j)[0].reshape(len(steps), len(steps))


@dataclass(frozen=True)
class Regularity:
    """periods: of the exemplar, (x, y) in pixels; none: it is not regular. exemplar, terrain: mean autocorrelation at
    their lags. ratio: terrain over exemplar.
    """

    periods: list[list[float]]
    exemplar: float
    terrain: float

    @property
    def ratio(self) -> float:
        return self.terrain / self.exemplar if self.periods else float("nan")


def measure_regularity(terrain: EndlessTerrain, levels: Levels, pixels: int) -> Regularity:
    """Autocorrelation of a terrain's brightness at the lags that its exemplar contains, with `pixels` a tile."""
    exemplar = picture_exemplar(levels, terrain.side, pixels)
    if not len(find_periods(correlate_local(exemplar, len(exemplar)))):
        return Regularity([], float("nan"), float("nan"))
    return compare_regularity(picture_terrain(terrain, pixels, 2).mean(-1), exemplar)


def compare_regularity(terrain: Float[Array, "h w"], exemplar: Float[Array, "n n"]) -> Regularity:
    """Autocorrelation of pictures at the lags that the exemplar contains. Raises: ValueError: it has no periods.

    These are the sums of its periods up to half its width at which it correlates half as well as one period away. On
    the terrain they may be turned and resized by up to 15 %: the map of lags that gives most is taken. What is wider
    than WIDE of the exemplar is subtracted from both.
    """
    width = len(exemplar)
    own, there = (correlate_local(picture, width) for picture in (exemplar, terrain))
    periods = find_periods(own)
    if not len(periods):
        raise ValueError("the exemplar has no periods")
    steps = [range(-width // 2, width // 2 + 1) if k < len(periods) else [0] for k in range(2)]
    lags = np.array([np.array([i, j][: len(periods)]) @ periods for i in steps[0] for j in steps[1]])
    length = np.hypot(*lags.T)
    lags = lags[(length > 0.5) & (length <= width / 2) & ((lags[:, 0] > 0) | ((lags[:, 0] == 0) & (lags[:, 1] > 0)))]
    at = _sample(own, lags)
    lags, at = lags[at >= 0.5 * at.max()], at[at >= 0.5 * at.max()]
    cases = [(float(_sample(there, lags @ _turn(a, s)).mean()), a, s) for a in TURNS for s in SIZES]
    _, angle, size = max(cases)
    found = minimize(
        lambda way: -float(_sample(there, lags @ way.reshape(2, 2)).mean()),
        _turn(angle, size).ravel(),
        method="Nelder-Mead",
    )
    return Regularity(periods.tolist(), float(at.mean()), float(-found.fun))


def _turn(angle: float, size: float) -> Float[Array, "2 2"]:
    return size * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def correlate_local(picture: Float[Array, "h w"], width: int) -> Float[Array, "h2 w2"]:
    """Autocorrelation without what is wider than WIDE of an exemplar of `width` pixels."""
    return lattice.autocorrelate((picture - gaussian_filter(picture, WIDE * width, mode="reflect"))[..., None])


def _sample(r: Float[Array, "h w"], lags: Float[Array, "k 2"]) -> Float[Array, "k"]:
    """Autocorrelation at lags (x, y), between pixels as well."""
    middle = np.array(r.shape) // 2
    return map_coordinates(r, (lags[:, ::-1] + middle).T, order=1, mode="nearest")


def find_periods(r: Float[Array, "h w"]) -> Float[Array, "k 2"]:
    """At most two periods (x, y) in pixels, the shorter ones of those with most autocorrelation; none: not regular.

    The first is the shortest peak beside the middle one that reaches four fifths of the highest; the second, of the
    others, is not along it.
    """
    y, x = np.indices(r.shape) - np.array(r.shape)[:, None, None] // 2
    length, central = np.hypot(x, y), _find_middle(r)
    peaks = (r == maximum_filter(r, 5)) & (r >= REGULAR) & ~central & (length <= LONGEST * len(r) / 2)
    peaks &= (x > 0) | ((x == 0) & (y > 0))
    lags, heights = np.stack([x[peaks], y[peaks]], 1).astype(float), r[peaks]
    periods: list[Array] = []
    for _ in range(2):
        if periods:
            cross = np.abs(lags @ np.array([-periods[0][1], periods[0][0]]))
            apart = cross > 0.4 * np.hypot(*lags.T) * np.hypot(*periods[0])
            lags, heights = lags[apart], heights[apart]
        if not len(lags):
            break
        good = lags[heights >= 0.8 * heights.max()]
        periods.append(_refine_peak(r, good[np.argmin(np.hypot(*good.T))]))
    return np.array(periods).reshape(-1, 2)


def _find_middle(r: Float[Array, "h w"]) -> Bool[Array, "h w"]:
    """The middle peak, down to half the least value that counts."""
    parts, _ = label(r > REGULAR / 2)
    return parts == parts[r.shape[0] // 2, r.shape[1] // 2]


def _refine_peak(r: Float[Array, "h w"], lag: Float[Array, "2"]) -> Float[Array, "2"]:
    """The vertex of the parabolas through a peak and its neighbours."""
    row, column = (lag[::-1] + np.array(r.shape) // 2).astype(int)
    moves = []
    for low, high in ((r[row, column - 1], r[row, column + 1]), (r[row - 1, column], r[row + 1, column])):
        bend = 2 * r[row, column] - low - high
        moves.append(np.clip(0.5 * (high - low) / bend, -0.5, 0.5) if bend > 0 else 0.0)
    return lag + moves


@dataclass(frozen=True)
class Jump:
    """Steps of brightness at tile borders over those at all other places; floor: at random lines beside borders, and
    the standard deviation of such lines' mean."""

    jump: float
    floor: float
    deviation: float


def measure_jump(picture: Float[Array, "h w"], columns: Float[Array, "k"], rows: Float[Array, "l"]) -> Jump:
    """Mean absolute step between neighbouring pixels within SPAN of borders over that elsewhere.

    columns, rows: where borders are, in pixels from the picture's corner.
    """
    rng, ways = np.random.default_rng(0), [(np.abs(np.diff(picture, axis=1)), columns)]
    ways.append((np.abs(np.diff(picture, axis=0)).T, rows))
    at, rest, random = [], [], []
    for steps, borders in ways:
        mean = steps.mean(0)
        away = np.abs(np.arange(1, len(mean) + 1)[:, None] - borders)
        inside = np.flatnonzero(away.min(1) > SPAN)
        rest.append(mean[inside].mean())
        at += [mean[away[:, k] < SPAN].mean() / rest[-1] for k in range(len(borders)) if (away[:, k] < SPAN).any()]
        middle = inside[np.all([np.isin(inside + k, inside) for k in range(-SPAN + 1, SPAN)], 0)]
        chosen = rng.choice(middle, LINES)
        random += [mean[c - SPAN + 1 : c + SPAN].mean() / rest[-1] for c in chosen]
    return Jump(float(np.mean(at)), float(np.mean(random)), float(np.std(random) / np.sqrt(len(at))))


def measure_jumps(terrain: EndlessTerrain, manifest: Manifest, exact: bool) -> Jump:
    """The jump in pictures from straight above, drawn in the order of cells as usual, or exactly by depth.

    From ABOVE eye floors: the 3 x 3 cells about the eye, which are sorted exactly, are a small part of the picture.
    """
    found, ground = [], float(np.median(terrain.tiles[0, 0].means[:, 2]))
    for k in range(PLACES):
        shot = stills.Shot("above", (5.5 * k + 0.5, 3.5 * k + 0.5), ABOVE, 90.0, 90.0)
        camera = stills.shot_camera(shot, terrain, manifest.eye_floor, WIDTH, WIDTH)
        picture = (
            stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour, exact).astype(float).mean(-1)
        )
        lines = terrain.side * np.arange(-terrain.reach, terrain.reach)[:, None] * [1, 1, 0] + [0, 0, ground]
        columns, rows = (np.where(kept, lines, [*camera.centre[:2], ground]) for kept in ([1, 0, 0], [0, 1, 0]))
        found.append(measure_jump(picture, camera.project(columns)[0][:, 0], camera.project(rows)[0][:, 1]))
    means = np.mean([list(asdict(jump).values()) for jump in found], 0).tolist()
    return Jump(means[0], means[1], means[2] / PLACES**0.5)
