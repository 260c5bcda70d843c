"""A made-up tile to look at: a rough ground of coloured discs, and stones on it."""

import numpy as np

from dav_gswt.field import Field, sh_of


def rough_ground(tile: int, cells: int, side: float, stones: float = 0.3) -> Field:
    """cells x cells discs that rise and fall by a tenth of their spacing, and a stone on some; its own by tile."""
    rng = np.random.default_rng([tile, cells])
    spacing = side / cells
    x, y = (v.ravel() for v in np.meshgrid(*[(np.arange(cells) + 0.5) * spacing] * 2))
    discs = np.stack([x, y, rng.normal(0, 0.1 * spacing, cells**2)], 1)
    chosen = discs[rng.random(cells**2) < stones]
    means = np.concatenate([discs, chosen + [0, 0, 0.3 * spacing]])
    sizes = np.full((len(means), 3), 0.35 * spacing)
    sizes[: len(discs)] = np.array([0.72, 0.72, 0.1]) * spacing
    waves = 0.5 + 0.15 * np.sin(means[:, :2] * (2 * np.pi / side))
    colours = np.stack([waves[:, 0], waves[:, 1], waves.mean(1)], 1) + rng.normal(0, 0.08, (len(means), 3))
    return Field(
        means.astype(np.float32),
        np.log(sizes).astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (len(means), 1)),
        np.full(len(means), 2.0, np.float32),
        sh_of(np.clip(colours, 0, 1).astype(np.float32)),
        np.zeros(len(means), np.float32),
        np.arange(len(means)) < len(discs),
    )
