"""How long a fit takes to a quality: real photos of dunes at a quarter of their size, and how it looks from elsewhere.

Photos and synthetic scenes are made by the workflow if they are not there yet. Every figure goes to results/bench.json.
"""

import subprocess
import sys
from pathlib import Path

import numpy as np
from record import report_figures
from scipy.spatial import cKDTree

from dav_gswt import raster
from dav_gswt.field import GaussianField
from dav_gswt.reconstruction.coarse import Reconstruction
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.ground import Ground
from dav_gswt_study import fit_profile

COPR = FitSettings(fit_size=256, spacing=1.5, max_gaussians=350_000, steps=1000)
HIGH = FitSettings(fit_size=384, spacing=1.25, max_gaussians=150_000, steps=400)
SCENES = ("desert_high", "meadow_high")
FREE = 0.1  # flying heights above the ground from which space is free
NEAR = 3.0  # spacings to a matched point within which a Gaussian may stand in it


def photos(scene: str) -> Path:
    """The scene's photos/, made if missing."""
    folder = Path("results") / scene / "photos"
    if not (folder / "ground.json").exists():
        command = [
            sys.executable,
            "-m",
            "snakemake",
            "--snakefile",
            "study/Snakefile",
            "--cores",
            "2",
            "--quiet",
            "all",
            "--",
            str(folder / "ground.json"),
        ]
        subprocess.run(command, check=True)
    return folder


def measure_haze(field: GaussianField, grid: Ground, given: fit_profile.PhotoSet) -> float:
    """Mean accumulated alpha, over the test views, of what stands higher than FREE flying heights above the ground and
    not at a matched point: the haze that photos from their own places reward."""
    above = field.means[:, 2] - grid.height_at(field.means)
    high = field[above > FREE * given.frame.flying_height]
    if len(high):
        distance = np.asarray(cKDTree(given.model.points).query(high.means)[0])
        high = high[distance > NEAR * grid.spacing]
    views = [view for group in given.tests.values() for view in group]
    return float(np.mean([raster.render(high, v.camera).alpha.mean() if len(high) else 0.0 for v in views]))


def measure_test_groups(given: fit_profile.PhotoSet, made: Reconstruction) -> dict[str, float]:
    """Mean PSNR of each group of test views, raw."""
    seen = {
        g: fit_profile.measure_quality(lambda v: raster.render(made.field, v.camera).colour, v)
        for g, v in given.tests.items()
    }
    return {group: metrics["psnr"] for group, metrics in seen.items()}


def copr() -> dict[str, float | None]:
    """Of the 38 photos that register every tenth is for testing; all ground that any photo sees is modelled."""
    given = fit_profile.read_photo_set(photos("copr_dunes"), COPR.fit_size)
    found = fit_profile.profile_fit(given, COPR)
    last = found.curve[-1]
    shape = f"{len(given.train)} photos, {last['gaussians']} Gaussians, {last['step']} steps"
    print(f"copr_dunes: {shape}, {last['seconds']:.1f} s")
    return {
        "train_copr_seconds_to_33": fit_profile.find_time_to(found.curve, 33.0),
        "train_copr_seconds_to_34": fit_profile.find_time_to(found.curve, 34.0),
        "train_copr_final_ccpsnr": last["psnr_colour_corrected"],
        "train_copr_final_psnr": last["psnr"],
        "train_copr_seconds": last["seconds"],
        "train_copr_free_space_opacity": measure_haze(found.made.field, found.made.grid, given),
    }


def offpath() -> dict[str, float]:
    """Fitted from above 60 degrees of elevation: PSNR of high test views less that of test views at 45 degrees."""
    out, losses = {}, []
    for scene in SCENES:
        given = fit_profile.read_photo_set(photos(scene), HIGH.fit_size, 0.15)
        seen = measure_test_groups(given, fit_profile.profile_fit(given, HIGH, every=10**6).made)
        losses.append(seen["high"] - seen["oblique"])
        out |= {f"offpath_{scene}_{group}_psnr": value for group, value in seen.items()}
        out[f"offpath_{scene}_loss_db"] = losses[-1]
    return out | {"offpath_loss_db": float(np.max(losses))}


TARGETS = {
    "train_copr_seconds_to_33": 8,
    "train_copr_seconds_to_34": 25,
    "train_copr_final_ccpsnr": 34.5,
    "train_copr_free_space_opacity": 0.005,
    "offpath_loss_db": 2,  # the worse scene
}


def main() -> None:
    report_figures(copr() | offpath(), TARGETS)


if __name__ == "__main__":
    main()
