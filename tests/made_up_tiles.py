"""A made-up exemplar: one disc a cell with a noisy texture and relief, and free Gaussians on it; its tiles."""

from types import SimpleNamespace

import numpy as np
from scipy.ndimage import gaussian_filter

from dav_gswt.field import Field, joined, sh_of
from dav_gswt.tiles import build
from dav_gswt.tiles.layout import Exemplar

WEST, SOUTH, SPACING, CELLS, LEVELS = -3.0, 7.0, 0.125, 96, 3


def splats(means, colours, sigma, ground):
    n = len(means)
    quats = np.tile(np.float32([1, 0, 0, 0]), (n, 1))
    return Field(
        np.asarray(means, np.float32),
        np.broadcast_to(np.log(np.float32(sigma)), (n, 3)).astype(np.float32),
        quats,
        np.full(n, 4, np.float32),
        sh_of(np.asarray(colours, np.float32)),
        np.zeros(n, np.float32),
        np.full(n, ground),
    )


def level(colour, height, spacing):
    rows, columns = height.shape
    y, x = np.mgrid[:rows, :columns]
    means = np.stack([WEST + (x + 0.5) * spacing, SOUTH + (y + 0.5) * spacing, height], -1).reshape(-1, 3)
    sigma = spacing * np.array([0.72, 0.72, 0.1])
    return splats(means, colour.reshape(-1, 3), sigma, True)


def halved(values):
    rows, columns = values.shape[:2]
    return values.reshape(rows // 2, 2, columns // 2, 2, *values.shape[2:]).mean((1, 3))


def exemplar():
    rng = np.random.default_rng(5)
    colour = 0.5 + 0.1 * rng.normal(size=(CELLS, CELLS, 3))
    colour += 0.5 * gaussian_filter(rng.normal(size=(CELLS, CELLS, 1)), (4, 4, 0))
    colour = np.clip(colour, 0, 1)
    height = 0.5 * gaussian_filter(rng.normal(size=(CELLS, CELLS)), 5)
    side = CELLS * SPACING
    place = np.concatenate([rng.random((300, 2)) * side + [WEST, SOUTH], rng.random((300, 1))], 1)
    things = splats(place, rng.random((300, 3)), [0.1, 0.1, 0.3], False)
    fields, c, h = [], colour, height
    for number in range(LEVELS):
        fields.append(joined([level(c, h, SPACING * 2**number), things]))
        c, h = halved(c), halved(h)
    return SimpleNamespace(levels=fields, colour=colour, height=height, exemplar=Exemplar(WEST, SOUTH, SPACING, CELLS))


def tiles_of(made_up, kind="semantic", corrected=True):
    options = build.Options(share=0.5, strip=0.17, candidates=40, tries=2, kind=kind, corrected=corrected)
    doubt = np.zeros((CELLS, CELLS))
    return build.cut_tiles(made_up.levels, made_up.exemplar, made_up.colour, doubt, options, np.random.default_rng(2))
