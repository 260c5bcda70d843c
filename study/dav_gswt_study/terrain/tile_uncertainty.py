"""The paper's figure of the tile cache: uncertainty of the tile in each cell, tiles with all orders, and a walk.

Source: DAV-GSWT, figure on the tile-level uncertainty cache.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.images import figures
from dav_gswt_study.seams.placed_tiles import tiles_in

MARGIN = 4  # cells shown beyond the walk, on all sides
BEND = 3.0  # tiles between bends of the walk
AMPLITUDE = 1.2  # tiles, to either side of the straight line


def make_walk(steps: int, length: float) -> Float[Array, "steps 2"]:
    """Places of a walk in tiles: on a straight line from the origin, swaying, so that it meets more tiles."""
    along = np.linspace(0, length, steps)
    return np.stack([along, AMPLITUDE * np.sin(np.pi * along / BEND)], 1) + 0.5


def read_cells(manifest: dict, west: int, south: int, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Uncertainty of the tile in each cell of a window, rows from the south, and whether it keeps all orders."""
    tiles = manifest["tiles"]
    numbers = tiles_in(west, south, shape, manifest["salt"], len(tiles) // 16)
    uncertainty = np.array([tile["uncertainty"] for tile in tiles])
    deep = np.array([len(tile["orders"]) == len(manifest["directions"]) for tile in tiles])
    return uncertainty[numbers], deep[numbers]


def write_figure(path: Path | str, manifest: dict, tau: float, length: float) -> None:
    """The terrain from above, a square a tile, warm where it is uncertain; dots: tiles that keep all orders; a line:
    the walk, `length` tiles long."""
    way = make_walk(200, length)
    (west, south), (east, north) = np.floor(way.min(0)).astype(int) - MARGIN, np.floor(way.max(0)).astype(int) + MARGIN
    shape = int(north - south + 1), int(east - west + 1)
    uncertainty, deep = read_cells(manifest, int(west), int(south), shape)
    figure = figures.make_figure(9.0, 7.2 * shape[0] / shape[1] + 0.9)
    axes = figure.subplots()
    extent = (west, east + 1, south, north + 1)
    seen = axes.imshow(uncertainty, origin="lower", extent=extent, cmap="inferno", interpolation="none")
    rows, columns = np.nonzero(deep)
    if deep.any():
        axes.plot(
            columns + west + 0.5, rows + south + 0.5, "o", color="#56b4e9", markersize=4, label="keeps all orders"
        )
    axes.plot(*way.T, color="white", linewidth=3.5)
    axes.plot(*way.T, color="#0072b2", linewidth=1.8, label="walk")
    axes.plot(*way[-1], ">", color="#0072b2", markeredgecolor="white", markersize=10)
    axes.set_xlim(west, east + 1)
    axes.set_ylim(south, north + 1)
    axes.set_xlabel("tiles east", fontsize=10)
    axes.set_ylabel("tiles north", fontsize=10)
    share = f"{100 * deep.mean():.0f} % of the cells keep all orders at tau = {tau:g}"
    axes.set_title(f"mean uncertainty of tiles; {share}", fontsize=10, loc="left")
    axes.legend(loc="upper right", fontsize=9)
    figure.colorbar(seen, ax=axes, shrink=0.8, label="mean uncertainty of the tile")
    figures.save_figure(figure, path)
