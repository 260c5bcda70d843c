"""Made-up exemplars of regular ground: brick paving and furrows, turned against the axes, as levels without photos."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import gaussian_filter

from dav_gswt.lod.store import Levels
from dav_gswt.reconstruction import discs
from dav_gswt.reconstruction.ground import Ground

CELLS, SPACING, LEVELS = 512, 0.01, 3
FINER = 3  # samples of a cell along each side
GRAIN = 0.02  # standard deviation of each cell's brightness
BRICK, MORTAR, BRICK_TURN = (61.3, 24.7), 3.4, 12.0  # cells (length and height with mortar), cells, degrees
FURROW, FURROW_TURN, WAVY = 33.7, 27.0, 1.0  # cells, degrees, cells that rows wander


def make_brick(seed: int = 0) -> Levels:
    """Running bond: courses shifted by half a brick, dark mortar, each brick a little different."""
    rng = np.random.default_rng(seed)
    along, across = _turned_grid(BRICK_TURN)
    course = np.floor(across / BRICK[1]).astype(int)
    place = along / BRICK[0] + 0.5 * (course % 2)
    brick = np.floor(place).astype(int)
    depth = np.minimum((place - brick) * BRICK[0], across - course * BRICK[1])
    mortar = depth < MORTAR
    shade = rng.normal(0, 0.025, (course.max() - course.min() + 1, brick.max() - brick.min() + 1))
    bright = np.where(mortar, 0.3, 0.5 + shade[course - course.min(), brick - brick.min()])
    return _make_levels(bright, np.zeros(bright.shape), (1.15, 0.95, 0.85), rng)


def make_furrows(seed: int = 0) -> Levels:
    """Rows of one period that wander a little, dark in the furrows."""
    rng = np.random.default_rng(seed)
    _, across = _turned_grid(FURROW_TURN)
    noise = gaussian_filter(rng.normal(size=across.shape), 20 * FINER, mode="reflect")
    wave = np.cos(2 * np.pi * (across + WAVY * noise / noise.std()) / FURROW)
    return _make_levels(0.42 + 0.08 * wave, 1.5 * SPACING * wave, (1.1, 1.0, 0.8), rng)


def _turned_grid(degrees: float) -> tuple[Float[Array, "n n"], Float[Array, "n n"]]:
    """Coordinates in cells along and across a direction, of FINER samples a cell."""
    steps = (np.arange(FINER * CELLS) + 0.5) / FINER
    x, y = np.meshgrid(steps, steps)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return c * x + s * y, c * y - s * x


def _make_levels(
    bright: Float[Array, "n n"], height: Float[Array, "n n"], tint: tuple[float, float, float], rng: np.random.Generator
) -> Levels:
    """Levels of one disc a cell, of maps with FINER samples a cell; each level is the mean of its finer neighbour."""
    bright, height = (_average(values, FINER) for values in (bright, height))
    bright = bright + rng.normal(0, GRAIN, bright.shape)
    fields, grids = [], []
    for number in range(LEVELS):
        grid = Ground(0.0, 0.0, SPACING * 2**number, 0, 0, len(height), height, np.ones(height.shape, bool))
        grids.append(grid)
        fields.append(discs.make_ground_discs(grid, np.clip(bright.reshape(-1, 1) * tint, 0, 1)))
        bright, height = _average(bright, 2), _average(height, 2)
    return Levels(fields, grids, LEVELS, "no more were made")


def _average(values: Float[Array, "n n"], by: int) -> Float[Array, "m m"]:
    count = len(values) // by
    return values.reshape(count, by, count, by).mean((1, 3))
