"""How sharp terrains are beside their photos: `sharpness.py RESULTS/SCENE [BEFORE/SCENE]`.

Of the newest bundle of each. With two, both are measured in the windows of the first. Prints JSON.
"""

import json
import sys
from pathlib import Path

import numpy as np
from record import read_installed_lpips

from dav_gswt.bundle import store
from dav_gswt.field import read_field
from dav_gswt.photos.colmap_model import read_colmap_model
from dav_gswt.photos.training_views import one_by_one, read_training_views
from dav_gswt.photos.view_split import read_view_split
from dav_gswt.reconstruction import evaluation
from dav_gswt_study import sharpness

NATIVE = 100_000  # photos at the size that registration left them


def find_bundle(scene: Path) -> Path:
    """The newest bundle of a scene."""
    return max(scene.glob("seed*/*/*/iter*/tiles_*/bundle_*/davgswt.json"), key=lambda path: path.stat().st_mtime)


def main(scenes: list[Path]) -> None:
    weights, seed = read_installed_lpips(), 0
    bundles = [find_bundle(scene).parent for scene in scenes]
    rounds = [bundle.parents[1] for bundle in bundles]
    windows = sharpness.read_windows(rounds[0] / "materials")
    photos = scenes[0] / "photos"
    known, split = read_colmap_model(photos / "sparse"), read_view_split(next(scenes[0].glob("seed*/views.json")))
    views = read_training_views(photos / "images", photos / "sparse", known.names, [], NATIVE, "/tmp")
    views = [sharpness.mask_to_windows(view, windows) for view in one_by_one(views)]
    pixels = [sharpness.measure_pixel_width(window, [view.camera for view in views]) for window in windows]
    fitted = [view for view in views if view.name not in split.test]
    bank = sharpness.cut_photo_crops(fitted, windows, float(np.mean(pixels)), np.random.default_rng(seed))
    tests, rows, crops = [view for view in views if view.name in split.test], [], []
    for bundle, folder in zip(bundles, rounds, strict=True):
        field, own = read_field(folder / "field.ply"), sharpness.read_windows(folder / "materials")
        rng = np.random.default_rng(seed)
        pictures = sharpness.render_terrain_crops(store.read_bundle(bundle), float(np.mean(pixels)), rng)
        crops.append(sharpness.measure_crop_distances(pictures, bank, weights))
        scores = evaluation.evaluate_field(field, tests, None, weights)
        shots = [view.camera for view in views]
        row = {"cell_ratios": [w.spacing / sharpness.measure_pixel_width(w, shots) for w in own]}
        row |= {"detail": sharpness.compare_detail(field, fitted), "crop_lpips": float(crops[-1].mean())}
        row |= {key: scores[key] for key in ("psnr_colour_corrected", "lpips")}
        rows.append(row | {"sides": [w.side for w in own], "gaussians": len(field)})
    out = {"tests": len(tests), "bank": len(bank), "rows": rows}
    if len(rows) > 1:
        rng = np.random.default_rng(seed)
        out["crop_lpips_change"] = sharpness.bootstrap_difference(crops[1], crops[0], rng)
    print(json.dumps(out, indent=1))


if __name__ == "__main__":
    main([Path(arg) for arg in sys.argv[1:]])
