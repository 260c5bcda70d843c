"""Is what stands or is sunk taken for ground? A land with houses, a hedge, a wood, a trench, a heap and shrubs.

Run as `python -m dav_gswt_study.materials.standing FOLDER`. Photos and field are kept there, for the next run.
"""

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.field import read_field, write_field
from dav_gswt.images import image_files
from dav_gswt.materials import build, store
from dav_gswt.materials.maps import measure_ground, sharpen_maps
from dav_gswt.photos.colmap_model import write_colmap_model
from dav_gswt.photos.synthetic import desert, land, meshes, mitsuba_scene, photo_set, plants, scene
from dav_gswt.photos.training_views import TrainingView, read_training_views
from dav_gswt.reconstruction import coarse, ground
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study.synthetic_views import place_start_views

PRESET = FitSettings(fit_size=384, spacing=1.25, max_gaussians=140000, steps=360, steps_per_photo=28)  # draft
PHOTOS = {"photo_count": 12, "min_elevation": 50, "size": 384, "seed": 0, "test": 0}
FRAME = scene.Scene("desert", 0).frame
# x, y, half width, half depth, height, in metres, and colour of roof and walls
HOUSES = ((-1.7, 1.6, 0.75, 0.5, 0.7, (0.35, 0.12, 0.08)), (1.4, 1.9, 0.5, 0.5, 0.6, (0.45, 0.44, 0.42)))
HEDGE = (-2.4, 0.1, -0.1, 0.15, 0.3)  # x from, to; y; half depth; height of its shrubs
WOOD = (0.9, 2.9, -2.9, -1.6, 0.8)  # x from, to; y from, to; height of its trees
TRENCH = (-1.0, 0.2, 0.45)  # x, half width, depth; as far as y = -0.6
HEAP = (1.6, 0.3, 0.75, 0.4)  # x, y, radius, height: sand at rest
SHRUBS = ((-2.2, -1.6), (-2.3, -2.4), (0.1, 0.9))
TEXELS = 24  # a side of a house


def make_house(rng: np.random.Generator, x: float, y: float, sides: Float[Array, "3"], colour: Any) -> meshes.Mesh:
    """A box whose sides have specks. sides: half width, half depth and height."""
    at = np.linspace(-1, 1, TEXELS)
    u, v = (each.ravel() for each in np.meshgrid(at, at))
    one = np.ones_like(u)
    faces = [(u, v, one)] + [(s * one, u, v) for s in (-1, 1)] + [(u, s * one, v) for s in (-1, 1)]
    points = np.concatenate([np.stack(face, 1) for face in faces])
    points = (points * [1, 1, 0.5] + [0, 0, 0.5]) * sides + [x, y, 0]
    number = np.arange(TEXELS * TEXELS).reshape(TEXELS, TEXELS)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]))
    side = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    triangles = np.concatenate([side + k * number.size for k in range(len(faces))])
    paint = np.array(colour) * rng.uniform(0.6, 1.4, (len(points), 1))
    return meshes.Mesh(points.astype(np.float32), triangles, paint.astype(np.float32))


def make_land() -> land.Land:
    """The land on flat sand."""
    rng = np.random.default_rng(0x57A9D)
    sand, small = desert.draw_sand(rng, desert.TEXELS, 0.19, 0.02, 25.0)
    raster = land.FadingRaster(np.zeros((8, 8)), 12.0, 30.0), land.FadingRaster(small, 7.0, 8.5)
    flat = land.make_relief(*raster, desert.DUNES)

    def height(x: Array, y: Array) -> Array:
        heap = HEAP[3] * np.maximum(0, 1 - np.hypot(x - HEAP[0], y - HEAP[1]) / HEAP[2])
        sunk = (np.abs(x - TRENCH[0]) < TRENCH[1]) & (y < -0.6) & (y > -3.5)
        return flat(x, y) + heap - TRENCH[2] * sunk

    hedge = [(x, HEDGE[2], HEDGE[4]) for x in np.arange(HEDGE[0], HEDGE[1], 0.12)]
    grid = np.meshgrid(np.arange(WOOD[0], WOOD[1], 0.3), np.arange(WOOD[2], WOOD[3], 0.3))
    wood = [(x, y, WOOD[4]) for x, y in np.stack(grid, -1).reshape(-1, 2) + rng.uniform(-0.08, 0.08, (grid[0].size, 2))]
    x, y, size = np.array([*hedge, *wood, *((*at, 0.3) for at in SHRUBS)]).T
    kinds = [plants.make_shrub(rng, plants.DRY_LEAF, (24, 36)) for _ in range(5)]
    places = land.stand_upright(rng, rng.integers(0, len(kinds), len(x)), x, y, height(x, y), size)
    houses = [make_house(rng, x, y, np.array(sides), colour) for x, y, *sides, colour in HOUSES]
    stones = meshes.merge_meshes(houses)
    return land.Land(land.make_ground_mesh(height), sand, land.PERIOD, stones, kinds, places, desert.LIGHT)


def find_truth(x: Float[Array, "m m"], y: Float[Array, "m m"]) -> dict[str, Bool[Array, "m m"]]:
    """What lies at places of the ground, by name."""
    houses = [(np.abs(x - at) < wide) & (np.abs(y - to) < deep) for at, to, wide, deep, *_ in HOUSES]
    return {
        "houses": np.any(houses, 0),
        "hedge": (x > HEDGE[0]) & (x < HEDGE[1]) & (np.abs(y - HEDGE[2]) < HEDGE[3]),
        "wood": (x > WOOD[0]) & (x < WOOD[1]) & (y > WOOD[2]) & (y < WOOD[3]),
        "trench": (np.abs(x - TRENCH[0]) < TRENCH[1]) & (y < -0.6),
        "heap": np.hypot(x - HEAP[0], y - HEAP[1]) < HEAP[2],
        "shrubs": np.any([np.hypot(x - at, y - to) < 0.1 for at, to in SHRUBS], 0),
    }


def photograph(folder: Path) -> list[TrainingView]:
    """The photos, rendered into a folder and kept there."""
    shots = [(f"view_{i:02}.png", camera) for i, camera in enumerate(place_start_views(PHOTOS, "cap"))]
    if not (folder / "sparse").exists():
        (folder / "images").mkdir(parents=True, exist_ok=True)
        world = mitsuba_scene.build_scene(make_land())
        for i, (name, camera) in enumerate(shots):
            light = mitsuba_scene.render_light(world, camera, scene.SAMPLES, i)
            image_files.write_png(folder / "images" / name, scene.encode_srgb(light))
        points = photo_set.triangulate_points(folder / "images", shots, 0)
        (folder / "sparse").mkdir()
        write_colmap_model(points, folder / "sparse")
    names = [name for name, _ in shots]
    return read_training_views(folder / "images", folder / "sparse", names, [], PRESET.fit_size)


def main(folder: Path) -> None:
    """Say which share of each thing is in a material and in an object, by maps of a draft and of photos."""
    views = photograph(folder)
    if not (folder / "ground.exr").exists():
        start = coarse.read_start_views(FRAME, views, folder / "sparse", folder / "images", False)
        fitted = coarse.fit_coarse_field(start, PRESET, np.random.default_rng(0))
        write_field(fitted.field, folder / "field.ply")
        ground.write_ground(fitted.grid, folder / "ground.exr")
    coarse_maps = measure_ground(read_field(folder / "field.ply"), ground.read_ground(folder / "ground.exr"))
    for kind, maps in (("draft", coarse_maps), ("photos", sharpen_maps(coarse_maps, views))):
        plan, place = build.plan_ground(maps, True), maps.exemplar
        middles = (np.arange(place.cells) + 0.5) * place.spacing
        truth = find_truth(*np.meshgrid(place.west + middles, place.south + middles))
        source, thing = np.any(plan.sources, 0), plan.classes.occupied
        shares = {name: (float(source[own].mean()), float(thing[own].mean())) for name, own in truth.items()}
        shown: Any = SimpleNamespace(classes=plan.classes, maps=maps)
        image_files.write_png(folder / f"{kind}.png", store.draw_classes(shown))
        rows = "; ".join(f"{name} {ground:.3f} {thing:.3f}" for name, (ground, thing) in shares.items())
        print(f"{kind}: share in a material, in an object: {rows}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
