"""A fit on an NVIDIA GPU, measured part by part, each within its seconds, on a machine without network.

`PYTHONPATH=study:benchmarks python study/benchmarks/gpu.py PHOTOS` with the folder results/copr_dunes/photos, made
before on any machine (`snakemake --cores 2 results/copr_dunes/photos/ground.json`); --only PART ... for some parts,
--dry-run to see what would be done. Needs the extra `cuda`; without a GPU it says so. results/gpu.json has
what was found so far, in earlier calls, too.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from raster import made

from dav_gswt.field import GaussianField, concatenate_fields
from dav_gswt.files import read_json, write_json
from dav_gswt.raster import backends
from dav_gswt.reconstruction import discs, ground
from dav_gswt.reconstruction.fitting import exposure, state, trainer
from dav_gswt.reconstruction.fitting.descent import TrainingState, TrainingTask
from dav_gswt.reconstruction.fitting.plan import FitPlan, FitSettings, Schedule
from dav_gswt.reconstruction.ground_constraints import GroundConstraints

ROOT = Path(__file__).resolve().parents[2]
DUNES = FitSettings(fit_size=768, spacing=1.5, max_gaussians=500_000, steps=300, steps_per_photo=20)
HUNDRED = replace(DUNES, fit_size=1024)
DECIBELS = 34, 35
RIVAL_STEPS, LOOKS = 4000, 20  # of gsplat's trainer; steps from look to look of ours, of it five times as many


@dataclass(frozen=True)
class Part:
    """seconds: after which it is stopped. targets: upper bounds of some of its figures."""

    what: str
    seconds: int
    targets: dict[str, float]


PARTS = {
    "step": Part("a step of a fit against its kernels", 60, {"step_over_kernels": 1.5}),
    "dunes": Part("copr_dunes to 34 and 35 dB beside gsplat's trainer", 180, {f"share_{d}": 0.5 for d in DECIBELS}),
    "start": Part("what precedes the first step", 60, {"seconds": 8}),
    "hundred": Part("a fit to 100 photos of 1024 pixels", 120, {"seconds": 60}),
}


def measure_step(
    device: str = "cuda", cells: int = 512, free: int = 170_000, size: tuple[int, int] = (1024, 768), steps: int = 100
) -> dict:
    """Milliseconds of a step on ground with things over it, and of gsplat's forward and backward pass in it alone."""
    import torch

    from dav_gswt.photos.training_views import TrainingView
    from dav_gswt.raster import cuda
    from dav_gswt.reconstruction.fitting.device_descent import DeviceDescent

    def wait() -> None:
        if device == "cuda":
            torch.cuda.synchronize()

    (width, height), span = size, 4.0
    grid = ground.Ground(-2.0, -2.0, span / cells, 0, 0, cells, np.zeros((cells, cells)), np.ones((cells, cells), bool))
    layer = discs.make_ground_discs(grid, np.full((cells**2, 3), 0.5))
    arrays, camera = made(width, height, free, (1, 3))
    arrays["means"][:, 2] -= 4
    camera = replace(camera, rotation=np.diag([1.0, -1.0, -1.0]), translation=np.array([0.0, 0.0, 4.4]))
    quats = arrays["quats"] / np.linalg.norm(arrays["quats"], axis=1, keepdims=True)
    things = GaussianField(
        np.clip(arrays["means"], -1.9, 1.9) * np.float32([1, 1, 0.1]), arrays["log_scales"], quats,
        arrays["opacity_logits"], arrays["colours"], np.zeros(free, np.float32), np.zeros(free, bool),
    )  # fmt: skip
    start = concatenate_fields([layer, discs.make_underlay(grid, layer), things])
    image = np.random.default_rng(0).uniform(0, 1, (height, width, 3)).astype(np.float32)
    views = [TrainingView("", camera, image, np.ones((height, width), np.float32))]
    begin, plan = state.from_field(start), FitPlan(10**6, 1, 1)
    begin.resize_sh(1)
    run = TrainingState(begin, np.random.default_rng(0), exposure.ExposureTracker(1))
    drawn = cuda.Rasterizer(device=device)
    task = TrainingTask(views, plan, Schedule(plan, len(start)), GroundConstraints(grid, np.ones(grid.shape)), drawn)
    descent = DeviceDescent(drawn)
    descent.start(run, task)
    for _ in range(max(1, steps // 10)):
        trainer._advance(run, task, descent)
    wait()
    begun = time.perf_counter()
    for _ in range(steps):
        trainer._advance(run, task, descent)
    wait()
    step, kernels = 1e3 * (time.perf_counter() - begun) / steps, []
    gradient = torch.ones(height, width, 3, device=device)
    for _ in range(max(3, steps // 10)):
        wait()
        begun = time.perf_counter()
        last = drawn.draw(run.state.values, descent._cameras[0])
        drawn.differentiate(last, gradient, gradient[..., 0])
        wait()
        kernels.append(1e3 * (time.perf_counter() - begun))
    found = {"gaussians": len(start), "step_ms": step, "kernels_ms": statistics.median(kernels)}
    if device == "cuda":
        found["memory_gb"] = torch.cuda.max_memory_allocated() / 1e9
    return found | {"step_over_kernels": step / found["kernels_ms"]}


def measure_fit(photos, settings: FitSettings, rival: bool = False) -> dict:
    """Seconds of a fit and how good it gets, and when it reaches DECIBELS. rival: beside gsplat's trainer."""
    from dav_gswt_study import fit_profile

    curves = {"ours": fit_profile.profile_fit(photos, settings, every=LOOKS)}
    if rival:
        from dav_gswt_study.gsplat_fit import profile_gsplat

        curves["gsplat"] = profile_gsplat(photos, RIVAL_STEPS, 5 * LOOKS)
    found: dict = {"curves": curves, "seconds": curves["ours"][-1]["seconds"], "photos": len(photos.train)}
    for decibel in DECIBELS:
        times = {name: fit_profile.find_time_to(curve, float(decibel)) for name, curve in curves.items()}
        found |= {f"{name}_to_{decibel}": seconds for name, seconds in times.items()}
        ours, theirs = times["ours"], times.get("gsplat")
        found[f"share_{decibel}"] = ours / theirs if ours is not None and theirs else None
    return found


def measure_start(photos, settings: FitSettings) -> dict:
    """Seconds until the first step is done, and the functions that take most of them."""
    import cProfile
    import pstats

    from dav_gswt.reconstruction.coarse import fit_coarse_field

    class FirstStepDone(Exception):
        pass

    def stop(step: int, now: state.State) -> None:
        raise FirstStepDone

    profile, begun = cProfile.Profile(), time.perf_counter()
    with suppress(FirstStepDone), profile:
        fit_coarse_field(photos.start_views(), settings, np.random.default_rng(0), trainer.FitOptions(callback=stop))
    seconds = time.perf_counter() - begun
    stats = pstats.Stats(profile).stats  # pyright: ignore[reportAttributeAccessIssue]
    own = {f"{Path(at[0]).stem}.{at[2]}": round(row[3], 2) for at, row in stats.items() if "dav_gswt" in at[0]}
    longest = dict(sorted(own.items(), key=lambda item: -item[1])[:20])
    return {"seconds": seconds, "photos": len(photos.train), "longest": longest}


def measure(name: str, folder: Path | None) -> dict:
    """Do a part here."""
    if name == "step":
        return measure_step()
    from dav_gswt_study.fit_profile import read_photo_set

    if folder is None:
        raise SystemExit(f"{name}: give the folder of photos")
    photos = read_photo_set(folder, 1024 if name == "hundred" else 768)
    if name == "hundred":  # each about three times: what a fit costs does not depend on what they show
        return measure_fit(replace(photos, train=(3 * photos.train)[:100]), HUNDRED)
    return measure_start(photos, DUNES) if name == "start" else measure_fit(photos, DUNES, rival=True)


def run_part(name: str, folder: Path | None) -> dict:
    """Do a part in a process of its own, which is stopped when its time is over."""
    command = [sys.executable, __file__, *([str(folder)] if folder else []), "--part", name]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=PARTS[name].seconds)
    except subprocess.TimeoutExpired:
        return {"stopped_after": PARTS[name].seconds}
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {"exit_status": done.returncode}


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("photos", nargs="?", type=Path)
    asked.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    asked.add_argument("--dry-run", action="store_true")
    asked.add_argument("--part", choices=PARTS)
    given = asked.parse_args()
    why = backends.explain_unavailable("cuda")
    if given.part:
        os.environ[backends.VARIABLE] = "cuda"
        print(json.dumps(measure(given.part, given.photos)))
    elif given.dry_run or why:
        print(f"gpu: nothing measured: {why or 'a dry run'}")
        for name in given.only:
            print(f"{name}: {PARTS[name].what}, at most {PARTS[name].seconds} s, targets {PARTS[name].targets}")
    else:
        path = ROOT / "results/gpu.json"
        found: dict[str, dict] = read_json(path) if path.exists() else {}
        for name in given.only:
            found[name] = run_part(name, given.photos)
            write_json(path, found)
        print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
