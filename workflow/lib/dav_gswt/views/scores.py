"""Scores of candidate poses, one raw value per term, stored in scores.csv; policies combine the terms.

The column of a term that is not available (no prior, no LPIPS weights) is empty.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.files import atomic_file
from dav_gswt.geometry.poses import Pose
from dav_gswt.views.uncertainty.weighting import Scales

TERMS = ("opacity", "coverage", "w2_sq", "lpips", "gradient", "single", "residual")
FIELDS = ("pose", "elevation", "azimuth", "radius", *TERMS, "steps", *(f"{term}_scale" for term in TERMS))


@dataclass(frozen=True)
class Scores:
    """Scores of n candidates. terms: the available ones of TERMS. scales: divisor of each term, fixed in the first
    round. steps: denoising steps behind the prior terms of a candidate; 0 without a prior."""

    poses: list[Pose]
    terms: dict[str, Float64[Array, "n"]]
    scales: Scales
    steps: Int[Array, "n"]

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def names(self) -> list[str]:
        return [pose.name for pose in self.poses]

    def term(self, name: str) -> Float64[Array, "n"]:
        """Return a term. Raises: InputError: it is not available."""
        if name not in self.terms:
            raise InputError(f"{name}: the poses were scored without it; it needs {_describe_requirement(name)}")
        return self.terms[name]


def _describe_requirement(name: str) -> str:
    """What a term needs, and where that is documented."""
    if name == "single":
        return (
            "a prior without dropout (p_drop 0), and the config's `lpips` as `installed` or a path "
            "(docs/reference/config.md)"
        )
    return "a prior (docs/prior.md)"


def write_scores(path: Path | str, scores: Scores) -> None:
    """Write scores.csv, one row per candidate; numbers are written exactly."""
    with atomic_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, FIELDS)
        table.writeheader()
        for i, pose in enumerate(scores.poses):
            row = {"pose": pose.name, "steps": int(scores.steps[i])}
            row |= {k: repr(getattr(pose, k)) for k in ("elevation", "azimuth", "radius")}
            row |= {name: repr(float(values[i])) for name, values in scores.terms.items()}
            row |= {f"{name}_scale": repr(scores.scales.by_term[name]) for name in scores.terms}
            table.writerow(row)


def read_scores(path: Path | str) -> Scores:
    """Read scores.csv. Raises: InputError: not such a table, or scores that are not finite, naming the poses."""
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        poses = [Pose(r["pose"], *(float(r[k]) for k in ("elevation", "azimuth", "radius"))) for r in rows]
        known = [name for name in TERMS if rows and rows[0][name]]
        terms = {name: np.array([float(r[name]) for r in rows]) for name in known}
        scales = Scales({name: float(rows[0][f"{name}_scale"]) for name in known})
        steps = np.array([int(r["steps"]) for r in rows], int)
        if not np.isfinite([(p.elevation, p.azimuth, p.radius) for p in poses]).all():
            raise ValueError("a pose is not finite")
    except (KeyError, TypeError, ValueError, OverflowError, OSError, csv.Error) as error:
        raise InputError(f"{path}: not a table of scores ({summarize_error(error)}); make it again") from error
    bad = sorted({i for values in terms.values() for i in np.flatnonzero(~np.isfinite(values))})
    if bad:
        raise InputError(f"{path}: the scores of {', '.join(poses[i].name for i in bad[:5])} are not finite")
    return Scores(poses, terms, scales, steps)
