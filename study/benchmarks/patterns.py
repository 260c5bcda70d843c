"""What gives terrains away from above: `patterns.py BUNDLE...` prints a table of each.

Beside a bundle's folder, or above it, are `tiles`, `seams.json` and `levels`, as in results; of a scene's folder in
results the newest bundle is taken. LANDMARKS=FOLDER keeps the landmarks there, or takes them from there, in a file
named by the exemplars. `patterns.py make brick|furrows FOLDER` makes the tiles and the bundle of regular ground.
"""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.bundle import build as bundles
from dav_gswt.bundle import store
from dav_gswt.bundle.land_cover import WaveEntry
from dav_gswt.lod.store import material_folder, write_levels
from dav_gswt.terrain import endless
from dav_gswt.terrain.fit_cover import gather_content
from dav_gswt.terrain.variation import Variation, fit_variation
from dav_gswt.tiles import build
from dav_gswt.tiles import store as tile_store
from dav_gswt.tiles.semantics import SemanticSource
from dav_gswt_study.markdown import format_table
from dav_gswt_study.terrain import lattice, patterns, regular

WEST, EAST = slice(1), slice(-1, None)  # the exemplar's windows in its halves
FINE = 96  # pixels a tile of the pictures that periods are measured in
TILING = {"tile": "auto", "strip": "auto", "variants": 2, "energy": "colour"}
KEPT = os.environ.get("LANDMARKS")


def find_bundle(folder: Path) -> Path:
    """The bundle in a folder: the folder itself, `bundle` in it, or the newest of a scene."""
    own = [path for path in (folder, folder / "bundle") if (path / "davgswt.json").exists()]
    scenes = folder.glob("seed*/*/*/iter*/tiles_*/bundle_*/davgswt.json")
    return own[0] if own else max(scenes, key=lambda path: path.stat().st_mtime).parent


def make_ground(kind: str, folder: Path) -> None:
    """Levels, tiles and bundle of regular ground."""
    levels = {"brick": regular.make_brick, "furrows": regular.make_furrows}[kind]()
    options = build.TilingOptions.from_config(TILING, SemanticSource(), levels.wanted)
    write_levels([levels], folder / "levels", {})
    tiles = build.cut_materials([levels], options, None, lambda number: build.make_generator(0, TILING, number))
    tile_store.write_tiles(tiles, folder / "tiles", folder / "seams.json", {})
    bundles.write_bundle(gather_content(tiles, None, 0), folder / "bundle", bundles.BundleOptions(tau=0.6), {})


def vary(alone: endless.EndlessTerrain, waves: list[WaveEntry] | None, number: int) -> endless.EndlessTerrain:
    """A terrain of one material alone, with its part of other waves."""
    own = [replace(wave, colours=[wave.colours[number]]) for wave in waves or []]
    return replace(alone, variation=Variation(own, alone.side, alone.salt))


def measure_bundle(folder: Path) -> list[list[str]]:
    """Rows of the table, one for all and one for each material."""
    around = folder.parent
    given = next(p for p in (around / "levels", around.parent / "levels") if p.exists())
    levels = tile_store.read_exemplars(around / "seams.json", given)
    bundle = store.read_bundle(folder)
    varied = endless.terrain_from_bundle(bundle, {"kind": "flat"})
    terrain = replace(varied, variation=None)  # noise of the place would hide a lattice from the measures
    tiles, salt = tile_store.read_material_tiles(around / "tiles", around / "seams.json", given), bundle.manifest.salt
    halves = [fit_variation(tiles, float(bool(varied.variation)), salt, side) for side in (WEST, EAST)]
    marks = [patterns.find_landmarks(own) for own in levels]
    if KEPT:
        path = Path(KEPT, "-".join(own.digest for own in marks) + ".json")
        path.exists() or patterns.write_landmarks(marks, path)
        marks = patterns.read_landmarks(path, levels)
    whole = lattice.measure_lattice(patterns.picture_terrain(terrain))
    usual, exact = (patterns.measure_jumps(terrain, bundle.manifest, exact) for exact in (False, True))
    jumps = f"{usual.jump:.3f} / {exact.jump:.3f} / {usual.floor:.3f} ±{usual.deviation:.3f}"
    rows = [["all", "", "", f"{whole.brightness:.3f}", f"{whole.landmarks:.3f}", "", "", "", "", jumps]]
    for number, (own, found) in enumerate(zip(levels, marks, strict=True)):
        alone = lattice.take_material(terrain, number)
        picture = patterns.picture_terrain(alone)
        both = [patterns.picture_terrain(vary(alone, waves, number)).mean(-1) for waves in halves]
        exemplar = patterns.picture_exemplar(own, terrain.side, lattice.PIXELS)
        octaves = patterns.compare_spectra((both[0], both[1]), exemplar, lattice.PIXELS)
        grid = lattice.measure_lattice(picture)
        with np.load(material_folder(around / "tiles", number) / "labels.npz") as tiles:
            copies = patterns.measure_landmarks(found, tiles["labels"], tiles["shifts"], patterns.choose_around(alone))
        rows_of = patterns.measure_regularity(alone, own, FINE)
        spectra = [
            f"{o.shortest:.2f}-{o.longest:.2f}: {o.ratio:.2f} ({o.ways[0]:.2f}, {o.ways[1]:.2f})" for o in octaves
        ]
        kept = [f"{rows_of.ratio:.2f} ({rows_of.terrain:.3f} / {rows_of.exemplar:.3f})" if rows_of.periods else "none"]
        rows.append(
            [bundle.manifest.materials[number].name, "; ".join(spectra), "; ".join(f"{o.halves:.2f}" for o in octaves)]
            + [f"{grid.brightness:.3f}", f"{grid.landmarks:.3f}", f"{copies.distance:.2f} ({copies.copies})"]
            + [f"{copies.shown:.2f} of {copies.count}", f"{copies.in_strips:.2f}", *kept, ""]
        )
    return rows


HEAD = [
    "of",
    "power in octaves (tiles)",
    "halves",
    "lattice",
    "of landmarks",
    "copy, tiles (copies)",
    "landmarks shown",
]
HEAD += ["copies in strips", "rows", "jump: usual / exact / floor"]


def main(args: list[str]) -> None:
    if args[0] == "make":
        make_ground(args[1], Path(args[2]))
        return
    for folder in args:
        print(f"\n## {folder}\n\n{format_table(HEAD, measure_bundle(find_bundle(Path(folder))))}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
