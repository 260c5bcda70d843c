"""How long a round of active views takes: choosing among 1000 candidates, and a whole round of the desert at `draft`.

Every figure goes to results/bench.json. The round: scores, selection by the default policy, four rendered photos, the
update, as the workflow runs them, its own start included; then the same with the scores of two priors.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from record import read_installed_lpips, report_figures

from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.poses import Pose, pose_offset
from dav_gswt.views.policies import NEEDS_FIELD, ORACLES, POLICIES, SelectionInput
from dav_gswt.views.scores import Scores
from dav_gswt.views.terms import TERMS
from dav_gswt.views.uncertainty import Scales

ROOT = Path(__file__).resolve().parents[1]
CANDIDATES, PHOTOS, CHOSEN = 1000, 28, 20
MORE_THAN_SCORES = {*NEEDS_FIELD, *ORACLES}
REPEATS = 5
CELLS = {  # the default policy first
    "round_draft_seconds": ("scores_none_pdrop0", "active_coverage-error_none_pdrop0_lam0_k4"),
    "round_draft_prior_seconds": ("scores_terrain_pdrop0.15", "active_coverage-w2_terrain_pdrop0.15_lam0_k4"),
    "round_draft_quick_prior_seconds": (
        "scores_terrain-quick_pdrop0.15",
        "active_coverage-w2_terrain-quick_pdrop0.15_lam0_k4",
    ),
}
TARGETS = {"select_1000_seconds": 0.2, "round_draft_seconds": 45, "round_draft_quick_prior_seconds": 45}


def selection() -> dict[str, float]:
    """The slowest policy that goes by scores alone, choosing as many as a round of the paper."""
    places = camera_layouts.hemisphere(CANDIDATES, 30.0, 7.0)
    found = [Pose(f"pose_{i:04d}", *p) for i, p in enumerate(places)]
    rng = np.random.default_rng(0)
    terms = {name: rng.uniform(0, 1, CANDIDATES) for name in TERMS}
    scores = Scores(found, terms, Scales.from_terms(terms), np.full(CANDIDATES, 8))
    captured = np.array([pose_offset(pose) for pose in found[:PHOTOS]])
    out = {}
    for name, policy in POLICIES.items():
        if name in MORE_THAN_SCORES:
            continue
        times = []
        for _ in range(REPEATS):
            start = time.perf_counter()
            policy.choose(scores, SelectionInput(captured, CHOSEN, np.random.default_rng(0), 0.1))
            times.append(time.perf_counter() - start)
        out[name] = min(times)
    slowest = max(out, key=out.get)
    print(f"the slowest policy is {slowest}")
    return {"select_1000_seconds": out[slowest]}


def rounds() -> dict[str, float]:
    """Wall-clock seconds of round 1, from the coarse field to the updated one."""
    if read_installed_lpips() is None:
        return {}
    out = {}
    with tempfile.TemporaryDirectory(prefix="round-") as folder:
        fit = "results/desert/seed0/draft"
        _made(folder, f"{fit}/coarse/field.ply")
        for name, (scored, cell) in CELLS.items():
            start = time.perf_counter()
            _made(folder, f"{fit}/{cell}/iter1/field.ply", f"{fit}/coarse/{scored}/scores.csv")
            out[name] = time.perf_counter() - start
    return out


def _made(folder: str, *targets: str) -> None:
    options = ["--snakefile", ROOT / "Snakefile", "--directory", folder, "--cores", "2", "--quiet", "all"]
    options += ["--configfile", ROOT / "config/config.yaml", "--"]
    subprocess.run([sys.executable, "-m", "snakemake", *map(str, options), *targets], check=True)


def main() -> None:
    report_figures(selection() | rounds(), TARGETS)


if __name__ == "__main__":
    main()
