"""How well ground in low sun is told apart: synthetic land with true labels, photographed and fitted as a draft.

Run as `python -m dav_gswt_study.materials.hard_light FOLDER [LAND ...]`. Fields are kept in the folder, so that another
run only classifies the ground again.
"""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from dav_gswt.field import GaussianField, read_field, write_field
from dav_gswt.images import image_files
from dav_gswt.images.srgb import encode_srgb
from dav_gswt.materials import build, store
from dav_gswt.materials.maps import measure_ground
from dav_gswt.photos.colmap_model import write_colmap_model
from dav_gswt.photos.synthetic import desert, mitsuba_scene, noise, oasis, photo_set, scene
from dav_gswt.photos.synthetic.land import (
    PERIOD,
    FadingRaster,
    GroundLabels,
    Land,
    Light,
    level_ground,
    make_ground_mesh,
    make_relief,
)
from dav_gswt.photos.synthetic.noise import smoothstep, texel_centres
from dav_gswt.photos.training_views import read_training_views
from dav_gswt.reconstruction import coarse, ground
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt_study.materials import accuracy
from dav_gswt_study.materials.true_labels import LabelMap, draw_label_map
from dav_gswt_study.synthetic_views import place_start_views

PRESET = FitSettings(fit_size=384, spacing=1.25, max_gaussians=140000, steps=360, steps_per_photo=28)  # draft
PHOTOS = {"photo_count": 12, "min_elevation": 50, "size": 384, "seed": 0, "test": 0}
FRAME = scene.Scene("oasis", 0).frame
HEAPS = ((-1.3, 0.7, 1.5, 0.9), (1.3, -0.9, 1.2, 0.75))  # x, y, radius and height in metres: sand at rest
LOAM = np.array([0.24, 0.15, 0.10])  # over sand: other ground, not its shade


def lower_sun(light: Light, elevation: float) -> Light:
    """The light with the sun at another height, exposed so that level ground gets as much of the sun as before."""
    exposure = np.sin(np.radians(light.elevation)) / np.sin(np.radians(elevation))
    dimmed = {name: tuple(min(exposure, 2.0) * v for v in getattr(light, name)) for name in ("zenith", "horizon")}
    below, sun = light.below * min(exposure, 2.0), tuple(exposure * v for v in light.sun)
    return replace(light, elevation=elevation, sun=sun, below=below, **dimmed)


def make_heaps(elevation: float, bed: bool) -> Land:
    """Two heaps on sand. bed: half of the ground, under one heap, is loam."""
    rng = np.random.default_rng([2, 0x4EA9])
    sand, small = desert.draw_sand(rng, desert.TEXELS, 0.21, 0.019, 62.0, gravel=0.0)
    large = 0.05 * noise.make_noise(rng, 512, PERIOD, longest=5.0, shortest=0.4, slope=1.2)
    x, _ = ((at + PERIOD / 2) % PERIOD - PERIOD / 2 for at in texel_centres(desert.TEXELS, PERIOD))
    wavy = x + 0.25 * noise.make_noise(rng, desert.TEXELS, PERIOD, 2.0, 0.1, 1.5)
    loam = smoothstep(-0.05, 0.05, wavy) * bed
    sand = (sand + loam[..., None] * (sand / desert.SAND * LOAM - sand)).astype(np.float32)
    relief = make_relief(FadingRaster(large, 7.0, 9.0), FadingRaster(small, 7.0, 8.5), desert.DUNES)

    def pile(x, y):
        heaps = [top * np.maximum(0, 1 - np.hypot(x - at, y - to) / wide) for at, to, wide, top in HEAPS]
        return relief(x, y) + sum(heaps)

    material = 1 + (loam > 0.5).astype(int)
    labels = GroundLabels({"sand": 1, "loam": 2} if bed else {"sand": 1}, material, PERIOD, ())
    mesh = make_ground_mesh(level_ground(pile, scene.EXEMPLAR))
    return Land(mesh, sand, PERIOD, None, [], np.zeros((0, 8)), lower_sun(desert.LIGHT, elevation), labels)


def make_oasis(seed: int, elevation: float | None = None) -> Land:
    """The oasis in its own or another sun."""
    made = oasis.make_land(seed, scene.EXEMPLAR)
    return made if elevation is None else replace(made, light=lower_sun(made.light, elevation))


LANDS: dict[str, Callable[[], Land]] = {
    "oasis": lambda: make_oasis(0),
    "oasis_1": lambda: make_oasis(1),
    "oasis_low": lambda: make_oasis(0, 15),
    "oasis_1_low": lambda: make_oasis(1, 15),
    "heaps_20": lambda: make_heaps(20, False),
    "heaps_40": lambda: make_heaps(40, False),
    "beds_20": lambda: make_heaps(20, True),
    "beds_40": lambda: make_heaps(40, True),
}


def fit_draft(land: Land, folder: Path) -> tuple[GaussianField, ground.Ground]:
    """The draft field of a land, from photos rendered into a folder; kept there."""
    if not (folder / "ground.exr").exists():
        for part in ("images", "sparse"):
            (folder / part).mkdir(parents=True, exist_ok=True)
        world = mitsuba_scene.build_scene(land)
        shots = [(f"view_{i:02}.png", camera) for i, camera in enumerate(place_start_views(PHOTOS, "cap"))]
        for i, (name, camera) in enumerate(shots):
            light = mitsuba_scene.render_light(world, camera, scene.SAMPLES, i)
            image_files.write_png(folder / "images" / name, encode_srgb(light))
        write_colmap_model(photo_set.triangulate_points(folder / "images", shots, 0), folder / "sparse")
        names = [name for name, _ in shots]
        views = read_training_views(folder / "images", folder / "sparse", names, [], PRESET.fit_size)
        start = coarse.read_start_views(FRAME, views, folder / "sparse", folder / "images", False)
        fitted = coarse.fit_coarse_field(start, PRESET, np.random.default_rng(0))
        write_field(fitted.field, folder / "field.ply")
        ground.write_ground(fitted.grid, folder / "ground.exr")
    return read_field(folder / "field.ply"), ground.read_ground(folder / "ground.exr")


def score_plan(plan: build.GroundPlan, truth: LabelMap) -> dict[str, Any]:
    """IoU of materials, F1 of objects; how many materials and strips there are, and the share shown nowhere."""
    classes, place = plan.classes, plan.maps.exemplar
    middles = (np.arange(place.cells) + 0.5) * place.spacing
    numbers = sum((k * each.cells for k, each in enumerate(classes.footprints, 1)), np.zeros(classes.kinds.shape, int))
    found = accuracy.FoundLabels(
        classes.materials, classes.kinds, numbers, classes.excluded, place.west + middles, place.south + middles
    )
    counted = {
        "materials": sum(bool(source.any()) for source in plan.sources),
        "strips": int(classes.kinds.max()) + 1 - classes.number,
        "excluded": float(classes.excluded.mean()),
    }
    return accuracy.score_materials(truth, found) | accuracy.score_objects(truth, found) | counted


def main(folder: Path, names: list[str]) -> None:
    """Measure these lands, or all; write scores and a picture of each."""
    for name in names or LANDS:
        land = LANDS[name]()
        assert land.labels is not None, "these lands have labels"
        field, grid = fit_draft(land, folder / name)
        plan = build.plan_ground(measure_ground(field, grid), True)
        shown: Any = SimpleNamespace(classes=plan.classes, maps=plan.maps)
        image_files.write_png(folder / f"{name}.png", store.draw_classes(shown))
        scores = score_plan(plan, draw_label_map(land.labels, FRAME.exemplar))
        print(name, json.dumps({key: round(value, 3) for key, value in scores.items()}), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
