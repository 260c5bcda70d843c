"""The table of extreme runs: a row for the outcome of each, and whether it was expected."""

import re
from pathlib import Path

import numpy as np

from dav_gswt.files import read_json
from dav_gswt.images import image_files, metrics
from dav_gswt_study.stability.extremes import EXTREMES, Extreme

NEAR_STILLS = ("walker", "oblique")  # stills that show single splats; from far above, sand has one colour
MIN_PSNR = 40.0  # dB between stills of worlds that differ in size alone: single roundings to 8 bits


def tabulate_runs(root: Path | str) -> list[dict]:
    """A row for each extreme. root: the folder that holds the runs' folders."""
    return [tabulate_run(extreme, Path(root)) for extreme in EXTREMES.values()]


def tabulate_run(extreme: Extreme, root: Path) -> dict:
    """The outcome of a run, and whether it was expected."""
    outcome = read_json(root / extreme.name / "outcome.json")
    finished = outcome["exit_code"] == 0
    blank = [name for name in NEAR_STILLS if finished and is_blank(root / extreme.name / f"{name}.png")]
    psnr = compare_stills(root / extreme.name, root / extreme.same_as) if extreme.same_as else None
    row = {key: outcome[key] for key in ("exit_code", "message", "traceback")}
    row |= {"files_checked": outcome["checked"], "not_finite": len(outcome["not_finite"]), "blank_stills": len(blank)}
    row |= {"like": extreme.same_as, "stills_psnr": psnr}
    row |= {"warnings": " / ".join(drop_photo_warnings(outcome["warnings"]))}
    cost = {"gaussians": outcome["gaussians"], "seconds": round(outcome["seconds"], 1)}
    expected = "message" if extreme.error_pattern else "ends"
    as_expected = (has_failed_as_expected if extreme.error_pattern else has_finished)(extreme, row)
    about = {"run": extreme.name, "about": extreme.about, "expected": expected, "as_expected": as_expected}
    return about | row | cost | {"peak_mb": round(outcome["peak_mb"])}


def has_failed_as_expected(extreme: Extreme, row: dict) -> bool:
    """Whether the run stopped with the expected message, without a traceback."""
    message = row["message"] or ""
    return (
        row["exit_code"] != 0 and not row["traceback"] and re.search(extreme.error_pattern or "", message) is not None
    )


def has_finished(extreme: Extreme, row: dict) -> bool:
    """Whether the run finished, all numbers are finite, and the stills show something, and what they should equal."""
    faults = row["exit_code"] or row["traceback"] or row["not_finite"] or row["blank_stills"]
    return not faults and (row["stills_psnr"] is None or row["stills_psnr"] >= MIN_PSNR)


def drop_photo_warnings(warnings: list[str]) -> list[str]:
    """Warnings without those about photos, of which the smallest experiment has too few."""
    return [line for line in warnings if not line.startswith("start view")]


def is_blank(path: Path) -> bool:
    """Whether the lower half of a picture has one colour."""
    picture = image_files.read_photo(path)
    return float(picture[len(picture) // 2 :].std((0, 1)).max()) < 1 / 255


def compare_stills(folder: Path, other: Path) -> float | None:
    """PSNR over all stills of two runs, at most 100; None where one of them has no still."""
    pairs = [(path, other / path.name) for path in sorted(folder.glob("*.png"))]
    if not pairs or not all(second.is_file() for _, second in pairs):
        return None
    a, b = (np.concatenate([image_files.read_photo(pair[i]) for pair in pairs]) for i in (0, 1))
    psnr = metrics.psnr(a, b, np.ones(a.shape[:2], np.float32))
    return 100.0 if psnr is None else min(100.0, float(psnr))
