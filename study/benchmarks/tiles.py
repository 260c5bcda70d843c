"""How long sixteen tiles of six levels take from a field of 200 000 Gaussians, and how much memory.

The field is synthetic: a textured ground with relief, its underlay, and grass on it. Counted: fitting the levels, and
cutting, composing and merging the tiles, as the rules make_levels and cut_tiles do; files and Python's start are not.
Every figure goes to results/bench.json.
"""

import resource
import subprocess
import sys
import time

import numpy as np
from record import report_figures
from scipy.ndimage import gaussian_filter

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.lod import build as levels
from dav_gswt.reconstruction import discs, top_view
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.tiles import build as tiles
from dav_gswt.tiles.layout import Exemplar

CELLS, SPACING, ALL = 384, 0.05, 200_000
STEPS = 60  # of each level's fit: preset `draft`
LEVELS = 6
TARGETS = {"tiles_200k_seconds": 10, "tiles_200k_memory_mb": 2000}


def make_field() -> tuple[GaussianField, Ground]:
    """A field of ALL Gaussians: a disc a cell, an underlay, and blades of grass for the rest."""
    rng = np.random.default_rng(0)
    soft = sum(s * gaussian_filter(rng.normal(size=(CELLS, CELLS)), s, mode="wrap") for s in (1, 3, 9))
    colour = np.clip(0.45 + 0.25 * soft[..., None] + 0.05 * rng.normal(size=(CELLS, CELLS, 3)), 0, 1)
    heights = 0.4 * gaussian_filter(rng.normal(size=(CELLS, CELLS)), 12, mode="wrap")
    grid = Ground(0.0, 0.0, SPACING, 0, 0, CELLS, heights, np.ones((CELLS, CELLS), bool))
    layer = discs.make_ground_discs(grid, colour.reshape(-1, 3))
    layer = concatenate_fields([layer, discs.make_underlay(grid, layer)])
    n = ALL - len(layer)
    place = np.concatenate([rng.uniform(0, CELLS * SPACING, (n, 2)), np.zeros((n, 1))], 1)
    place[:, 2] = grid.height_at(place) + SPACING * rng.uniform(1, 6, n)
    blades = GaussianField(
        place.astype(np.float32),
        np.log(SPACING * np.tile([0.3, 0.3, 1.2], (n, 1))).astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        np.full(n, 2, np.float32),
        rgb_to_sh(np.clip(rng.normal([0.25, 0.4, 0.15], 0.05, (n, 3)), 0, 1)),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )
    return concatenate_fields([layer, blades]), grid


def measured() -> dict[str, float]:
    field, grid = make_field()
    start = time.perf_counter()
    made = levels.build_levels(field, grid, LEVELS, STEPS, 0)
    fitted = time.perf_counter()
    above = top_view.render_exemplar(made.fields[0], grid)
    west, south, _ = grid.exemplar
    exemplar = Exemplar(west, south, grid.spacing, grid.cells)
    options, rng = tiles.TilingOptions(levels=made.wanted), np.random.default_rng(0)
    found = tiles.cut_tiles(made.fields, exemplar, above.colour_or_nan(), above.uncertainty, options, rng)
    cut = time.perf_counter()
    assert [len(found.fields), len(found.labels)] == [LEVELS, 16]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
    return {
        "tiles_200k_seconds": cut - start,
        "tiles_200k_levels_seconds": fitted - start,
        "tiles_200k_cut_seconds": cut - fitted,
        "tiles_200k_memory_mb": peak,
    }


def main() -> None:
    """In a process of its own: peak memory is the process's."""
    done = subprocess.run([sys.executable, __file__, "--here"], stdout=subprocess.PIPE, text=True, check=True)
    values = {name: float(value) for name, value in (line.split() for line in done.stdout.splitlines())}
    report_figures(values, TARGETS)


if __name__ == "__main__":
    if "--here" in sys.argv:
        for name, value in measured().items():
            print(name, value)
    else:
        main()
