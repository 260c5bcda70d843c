"""How long the pre-sorting of a tile set takes, and what pre-sorted orders do to a walker's picture.

A synthetic set of 16 tiles at 6 levels, 1.5 million Gaussians: a rough ground of discs with stones. Pre-sorting is
what a bundle does: the search for the directions, and every order of every tile at every level. The walker's picture
is drawn as the page draws it, from the bundle's rounded Gaussians, against all of these sorted exactly.
"""

import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from fixtures.splats import rough_ground
from fixtures.tile_sets import report_of
from record import report_figures

from dav_gswt.bundle import build, direction_search, orders, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.terrain import endless, stills
from dav_gswt.tiles.build import TileSet

CELLS, LEVELS, SIDE = 232, 6, 4.0
TARGETS = {"presort_seconds": 2.0, "terrain_presort_psnr": 40.0}


def tile_set(cells: int, levels: int) -> TileSet:
    """Sixteen tiles, each level with half the cells a side; half of the tiles are uncertain."""
    fields = [[rough_ground(tile, cells >> level, SIDE) for tile in range(16)] for level in range(levels)]
    labels, uncertainty = np.zeros((16, cells, cells), np.uint8), np.arange(16) / 15
    return TileSet(SIDE, SIDE / cells, fields, labels, np.zeros((16, 9, 2), int), uncertainty, report_of())


def presorting(tiles: TileSet, threads: int) -> tuple[float, float, int]:
    """Seconds of the search for directions and of sorting, and how many directions there are."""
    start = time.perf_counter()
    rings = direction_search.search_directions(tiles.fields[0], tiles.side)
    searched = time.perf_counter() - start
    along = rings.directions()
    kept = [along[rings.select_directions(u, 0.5)] for u in tiles.uncertainty]
    jobs = [(f.means, kept[tile]) for row in tiles.fields for tile, f in enumerate(row)]
    start = time.perf_counter()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda job: orders.presort(*job), jobs))
    return searched, time.perf_counter() - start, len(along)


def walker(tiles: TileSet) -> float | None:
    """PSNR of a walker's still in pre-sorted orders against all Gaussians sorted exactly."""
    with tempfile.TemporaryDirectory() as folder:
        content, options = BundleContent.of_one_material(tiles), build.BundleOptions(tau=0.5)
        build.write_bundle(content, Path(folder, "bundle"), options, {})
        bundle = store.read_bundle(Path(folder, "bundle"))
        terrain = endless.terrain_from_bundle(bundle, {"kind": "flat"})
    value = bundle.manifest
    camera = stills.shot_camera(stills.SHOTS[0], terrain, value.eye_floor, 960, 540)
    pictures = [stills.render_view(terrain, camera, value.sky, value.ground_colour, exact) for exact in (False, True)]
    return direction_search.compute_psnr([tuple(pictures)])


def main() -> int:
    tiles = tile_set(CELLS, LEVELS)
    count = sum(len(f) for row in tiles.fields for f in row)
    found = [presorting(tiles, threads=2) for _ in range(3)]
    searched, sorting, directions = min(found)
    print(
        f"{count:,} Gaussians, {directions} directions: found in {searched:.2f} s, sorted in {sorting:.2f} s, 2 threads"
    )
    report_figures(
        {"presort_seconds": searched + sorting, "terrain_presort_psnr": walker(tile_set(CELLS // 2, 4))}, TARGETS
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
