"""The two tables: a row a formula, a row a run; written, read back, and what a run's row says."""

import re
from pathlib import Path

import numpy as np

from dav_gswt.files import read_json
from dav_gswt.images import image_files, metrics
from dav_gswt.study.stability.extremes import EXTREMES, Extreme
from dav_gswt.study.stability.formula import row
from dav_gswt.study.stability.registry import GROUPS

NEAR = ("walker", "oblique")  # stills that see single splats; from far above sand is of one colour
ALIKE = 40.0  # dB between the stills of worlds that differ in size alone: single roundings to 8 bits


def formulas() -> list[dict]:
    """A row for each formula of the registry."""
    return [{"group": group} | row(formula) for group, members in GROUPS.items() for formula in members]


def runs(root: Path | str) -> list[dict]:
    """A row for each extreme. root: the folder that holds the runs' folders."""
    return [run(extreme, Path(root)) for extreme in EXTREMES.values()]


def run(extreme: Extreme, root: Path) -> dict:
    """What came of a run, and whether that was expected."""
    found = read_json(root / extreme.name / "outcome.json")
    blank = [name for name in NEAR if found["exit_code"] == 0 and is_blank(root / extreme.name / f"{name}.png")]
    alike = likeness(root / extreme.name, root / extreme.like) if extreme.like else None
    told = {"exit_code": found["exit_code"], "message": found["message"], "traceback": found["traceback"]}
    told |= {"files_checked": found["checked"], "not_finite": len(found["not_finite"]), "blank_stills": len(blank)}
    told |= {"like": extreme.like, "stills_psnr": alike, "warnings": " / ".join(known_warnings(found["warnings"]))}
    facts = {"gaussians": found["gaussians"], "seconds": round(found["seconds"], 1), "peak_mb": round(found["peak_mb"])}
    expected = "message" if extreme.says else "ends"
    as_expected = (failed_well if extreme.says else ended_well)(extreme, told)
    return (
        {"run": extreme.name, "about": extreme.about, "expected": expected, "as_expected": as_expected} | told | facts
    )


def failed_well(extreme: Extreme, told: dict) -> bool:
    """It ended with the one message that was expected, without a traceback."""
    said = told["message"] or ""
    return told["exit_code"] != 0 and not told["traceback"] and re.search(extreme.says, said) is not None


def ended_well(extreme: Extreme, told: dict) -> bool:
    """It ended, every number is finite, the stills show something, and what they are to resemble."""
    faults = told["exit_code"] or told["traceback"] or told["not_finite"] or told["blank_stills"]
    return not faults and (told["stills_psnr"] is None or told["stills_psnr"] >= ALIKE)


def known_warnings(found: list[str]) -> list[str]:
    """Without those about photos, which the smallest experiment has too few of."""
    return [line for line in found if not line.startswith("start view")]


def is_blank(path: Path) -> bool:
    """Whether a picture's lower half is of one colour."""
    picture = image_files.read_photo(path)
    return float(picture[len(picture) // 2 :].std((0, 1)).max()) < 1 / 255


def likeness(folder: Path, other: Path) -> float | None:
    """PSNR over all stills of two runs, 100 where they are equal; None where one has none."""
    pairs = [(path, other / path.name) for path in sorted(folder.glob("*.png"))]
    if not pairs or not all(second.is_file() for _, second in pairs):
        return None
    a, b = (np.concatenate([image_files.read_photo(pair[i]) for pair in pairs]) for i in (0, 1))
    found = metrics.psnr(a, b, np.ones(a.shape[:2], np.float32))
    return 100.0 if found is None else min(100.0, float(found))
