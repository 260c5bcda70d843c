"""Does the terrain repeat? The autocorrelation of a large top view at the tile's period, and the exemplar's own.

r(d) = mean over x of (f(x) - m)(f(x + d) - m) / variance, summed over colour channels, where x and x + d are both in
the picture: 1 at d = 0. Wang tiles share strips and corners, so r at the period is not 0; what matters is that it does
not stand out from r around it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.raster import render
from dav_gswt.terrain.choice import tiles_in
from dav_gswt.tiles.build import TileSet

TILES, WINDOWS = 12, 4  # a side of a top view, and how many there are
LAGS = ((1, 0), (0, 1), (1, 1), (2, 0), (0, 2))  # in tiles, east and north
AROUND = 0.25  # of a tile: what is that near to a lag, and not at it, is around it
AT = 0.04  # of a tile: what is that near is at it


@dataclass(frozen=True)
class Repeats:
    """Autocorrelations of terrain and exemplar, lag 0 in the middle, `pixels` a tile."""

    terrain: Float[Array, "h w"]
    exemplar: Float[Array, "h1 w1"]
    pixels: int


def repeats(tiles: TileSet, exemplar: list[GaussianField], side: float, salt: int) -> Repeats:
    """exemplar: its levels, trend out, from (0, 0), `side` wide. From above, a pixel a cell of the second level.

    The terrain is seen in WINDOWS places: in one of them equal tiles lie two apart half as often again, or
    half as often, as they do on the whole, by chance.
    """
    level = min(1, len(tiles.fields) - 1)
    pixel = tiles.spacing * 2**level
    laid = [_laid(tiles, level, TILES * k, salt) for k in range(WINDOWS)]
    terrain = np.mean([autocorrelation(_above(part, TILES * tiles.side, pixel)) for part in laid], 0)
    return Repeats(terrain, autocorrelation(_above(exemplar[level], side, pixel)), round(tiles.side / pixel))


def _laid(tiles: TileSet, level: int, first: int, salt: int) -> GaussianField:
    """The terrain's tiles from (first, 0) on, from the origin on."""
    numbers = tiles_in(first, 0, (TILES, TILES), salt, tiles.variants)
    at = [(number, i, j) for j, row in enumerate(numbers.tolist()) for i, number in enumerate(row)]
    return concatenate_fields(
        [_moved(tiles.fields[level][number], i * tiles.side, j * tiles.side) for number, i, j in at]
    )


def _moved(field: GaussianField, east: float, north: float) -> GaussianField:
    return replace(field, means=field.means + np.float32([east, north, 0]))


def _above(field: GaussianField, side: float, pixel: float) -> Float[Array, "h w 3"]:
    count = round(side / pixel)
    top = float(field.means[:, 2].max()) + 10 * pixel
    return render(field, cameras.top_down(0.0, 0.0, count, count, pixel, top)).colour


def autocorrelation(picture: Float[Array, "h w c"]) -> Float[Array, "h1 w1"]:
    """r at all lags up to the picture's size, rows and columns, lag 0 in the middle; 0 for a picture of one colour."""
    f = picture - picture.mean((0, 1))
    shape = [2 * n for n in f.shape[:2]]
    power = (np.abs(np.fft.rfft2(f, shape, (0, 1))) ** 2).sum(-1)
    total = np.fft.fftshift(np.fft.irfft2(power, shape))
    (h, w), variance = f.shape[:2], float((f**2).sum(-1).mean())
    pairs = np.outer(h - np.abs(np.arange(-h, h)), w - np.abs(np.arange(-w, w)))
    return total / np.maximum(pairs, 1) / variance if variance > 1e-12 else np.zeros_like(total)


def rows(found: Repeats) -> list[dict]:
    """For each lag: r of the terrain, the highest r within AT of it, the largest |r| around, and the exemplar's r there
    (empty where it is not that large).
    """
    out = []
    for east, north in LAGS:
        lag = (east * found.pixels, north * found.pixels)
        y, x = np.indices(found.terrain.shape) - np.array(found.terrain.shape)[:, None, None] // 2
        away = np.hypot(x - lag[0], y + lag[1]) / found.pixels  # rows go south
        at, around = away <= AT, (away > 2 * AT) & (away <= AROUND)
        out.append(
            {
                "east": east,
                "north": north,
                "terrain": _at(found.terrain, lag),
                "peak": float(found.terrain[at].max()),
                "around": float(np.abs(found.terrain[around]).max()),
                "exemplar": _at(found.exemplar, lag),
            }
        )
    return out


def _at(r: Float[Array, "h w"], lag: tuple[int, int]) -> float | None:
    h, w = r.shape
    row, column = h // 2 - lag[1], w // 2 + lag[0]
    inside = abs(lag[0]) < 0.75 * w / 2 and abs(lag[1]) < 0.75 * h / 2  # further out few pixels are left to compare
    return float(r[row, column]) if inside else None
