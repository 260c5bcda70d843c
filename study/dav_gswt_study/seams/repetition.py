"""Repetition of the terrain: autocorrelation of a large top view at the tile's period, and of the exemplar.

r(d) = mean over x of (f(x) - m)(f(x + d) - m) / variance, summed over colour channels, where x and x + d are both in
the picture: 1 at d = 0. Wang tiles share strips and corners, so r at the period is not 0; it must not stand out from r
around it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.raster import render
from dav_gswt.terrain.choice import tiles_at
from dav_gswt.tiles.build import TileSet

TILES, WINDOWS = 12, 4  # a side of a top view, and how many there are
LAGS = ((1, 0), (0, 1), (1, 1), (2, 0), (0, 2))  # in tiles, east and north
AROUND_RADIUS = 0.25  # of a tile: lags within this radius, and not at the lag, are around it
AT_RADIUS = 0.04  # of a tile: lags within this radius are at the lag


@dataclass(frozen=True)
class Autocorrelations:
    """Autocorrelations of terrain and exemplar, lag 0 in the middle, `pixels` a tile."""

    terrain: Float[Array, "h w"]
    exemplar: Float[Array, "h1 w1"]
    pixels: int


def measure_repetition(tiles: TileSet, exemplar: list[GaussianField], side: float, salt: int) -> Autocorrelations:
    """Autocorrelations of top views with a pixel for each cell of the second level.

    The terrain is rendered in WINDOWS places and averaged: within one of them, how often equal tiles are two apart
    varies by half by chance. exemplar: its levels without trend, from (0, 0), `side` wide.
    """
    level = min(1, len(tiles.fields) - 1)
    pixel = tiles.spacing * 2**level
    parts = [_place_tiles(tiles, level, TILES * k, salt) for k in range(WINDOWS)]
    terrain = np.mean([autocorrelate(_render_top_view(part, TILES * tiles.side, pixel)) for part in parts], 0)
    return Autocorrelations(
        terrain, autocorrelate(_render_top_view(exemplar[level], side, pixel)), round(tiles.side / pixel)
    )


def tiles_in(west: int, south: int, shape: tuple[int, int], salt: int, variants: int) -> Int64[Array, "h w"]:
    """Tile numbers of a window of cells: row 0 holds cells (west, south), (west + 1, south), ..."""
    height, width = shape
    return tiles_at(*np.meshgrid(west + np.arange(width), south + np.arange(height)), salt, variants)


def _place_tiles(tiles: TileSet, level: int, first: int, salt: int) -> GaussianField:
    """TILES x TILES tiles of the terrain from the cell (first, 0), moved to the origin."""
    numbers = tiles_in(first, 0, (TILES, TILES), salt, tiles.variants)
    at = [(number, i, j) for j, row in enumerate(numbers.tolist()) for i, number in enumerate(row)]
    return concatenate_fields(
        [_move(tiles.fields[level][number], i * tiles.side, j * tiles.side) for number, i, j in at]
    )


def _move(field: GaussianField, east: float, north: float) -> GaussianField:
    return replace(field, means=field.means + np.array([east, north, 0], np.float32))


def _render_top_view(field: GaussianField, side: float, pixel: float) -> Float[Array, "h w 3"]:
    count = round(side / pixel)
    top = float(field.means[:, 2].max()) + 10 * pixel
    return render(field, cameras.top_down(0.0, 0.0, count, count, pixel, top)).colour


def autocorrelate(picture: Float[Array, "h w c"]) -> Float[Array, "h1 w1"]:
    """r at all lags up to the picture's size, rows and columns, lag 0 in the middle; 0 for a picture of one colour."""
    f = picture - picture.mean((0, 1))
    shape = [2 * n for n in f.shape[:2]]
    power = (np.abs(np.fft.rfft2(f, shape, (0, 1))) ** 2).sum(-1)
    total = np.fft.fftshift(np.fft.irfft2(power, shape))
    (h, w), variance = f.shape[:2], float((f**2).sum(-1).mean())
    pairs = np.outer(h - np.abs(np.arange(-h, h)), w - np.abs(np.arange(-w, w)))
    return total / np.maximum(pairs, 1) / variance if variance > 1e-12 else np.zeros_like(total)


def tabulate_repetition(measured: Autocorrelations) -> list[dict]:
    """For each lag: r of the terrain, the highest r at the lag, the largest |r| around it, and r of the exemplar (None
    where the exemplar is smaller than the lag).
    """
    out = []
    for east, north in LAGS:
        lag = (east * measured.pixels, north * measured.pixels)
        y, x = np.indices(measured.terrain.shape) - np.array(measured.terrain.shape)[:, None, None] // 2
        away = np.hypot(x - lag[0], y + lag[1]) / measured.pixels  # rows go south
        at, around = away <= AT_RADIUS, (away > 2 * AT_RADIUS) & (away <= AROUND_RADIUS)
        out.append(
            {
                "east": east,
                "north": north,
                "terrain": _value_at(measured.terrain, lag),
                "peak": float(measured.terrain[at].max()),
                "around": float(np.abs(measured.terrain[around]).max()),
                "exemplar": _value_at(measured.exemplar, lag),
            }
        )
    return out


def _value_at(r: Float[Array, "h w"], lag: tuple[int, int]) -> float | None:
    h, w = r.shape
    row, column = h // 2 - lag[1], w // 2 + lag[0]
    inside = abs(lag[0]) < 0.75 * w / 2 and abs(lag[1]) < 0.75 * h / 2  # at larger lags too few pixels overlap
    return float(r[row, column]) if inside else None
