"""Scores of candidate poses: scores.csv, scores.json with the scales that the first round fixes, and maps.npz.

scores.csv has one raw value per term; policies combine the terms. The column of a term that is not available (no prior,
no LPIPS weights) is empty. maps.npz has the maps of all poses.
"""

import csv
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array

from dav_gswt.errors import InputError, summarize_error
from dav_gswt.field import GaussianField
from dav_gswt.files import UNREADABLE, atomic_file, read_json, write_json
from dav_gswt.geometry.poses import Pose
from dav_gswt.provenance import record_provenance
from dav_gswt.views.uncertainty import Quantiles, Scales

PLACE = "elevation", "azimuth", "radius"


@dataclass(frozen=True)
class Scores:
    """Scores of n candidates.

    terms: the available ones of `terms.TERMS`. scales: divisor of each term, fixed in the first round.
    """

    poses: list[Pose]
    terms: dict[str, Float64[Array, "n"]]
    scales: Scales

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def names(self) -> list[str]:
        return [pose.name for pose in self.poses]

    def term(self, name: str) -> Float64[Array, "n"]:
        """Return a term. Raises: InputError: it is not available."""
        if name not in self.terms:
            raise InputError(f"{name}: the poses were scored without it; it needs {_list_terms()[name].requires}")
        return self.terms[name]


def _list_terms() -> dict:
    from dav_gswt.views.terms import TERMS  # deferred: the workflow reads this module before any job

    return TERMS


def list_columns() -> tuple[str, ...]:
    """The columns of scores.csv."""
    names = _list_terms()
    return ("pose", *PLACE, *names, *(f"{name}_scale" for name in names))


def write_scores(path: Path | str, scores: Scores) -> None:
    """Write scores.csv, one row per candidate; numbers are written exactly."""
    with atomic_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list_columns())
        table.writeheader()
        for i, pose in enumerate(scores.poses):
            row = {"pose": pose.name} | {k: repr(getattr(pose, k)) for k in PLACE}
            row |= {name: repr(float(values[i])) for name, values in scores.terms.items()}
            row |= {f"{name}_scale": repr(scores.scales.by_term[name]) for name in scores.terms}
            table.writerow(row)


def read_scores(path: Path | str) -> Scores:
    """Read scores.csv. Raises: InputError: not such a table, or scores that are not finite, naming the poses."""
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        poses = [Pose(r["pose"], *(float(r[k]) for k in PLACE)) for r in rows]
        known = [name for name in _list_terms() if rows and rows[0][name]]
        terms = {name: np.array([float(r[name]) for r in rows]) for name in known}
        scales = Scales({name: float(rows[0][f"{name}_scale"]) for name in known})
        if not np.isfinite([(p.elevation, p.azimuth, p.radius) for p in poses]).all():
            raise ValueError("a pose is not finite")
    except (KeyError, TypeError, ValueError, OverflowError, OSError, csv.Error) as error:
        raise InputError(f"{path}: not a table of scores ({summarize_error(error)}); make it again") from error
    bad = sorted({i for values in terms.values() for i in np.flatnonzero(~np.isfinite(values))})
    if bad:
        raise InputError(f"{path}: the scores of {', '.join(poses[i].name for i in bad[:5])} are not finite")
    return Scores(poses, terms, scales)


@dataclass(frozen=True)
class FrozenScales:
    """What the first round of a scene fixes for all later rounds.

    scales: of the terms. pixels: values of w2_sq maps that become 0 and 1 in uncertainties of Gaussians; None without a
    prior.
    """

    scales: Scales
    pixels: Quantiles | None


def read_frozen_scales(path: Path | str) -> FrozenScales:
    """Read scores.json. Raises: InputError: not that of a first round."""
    found = read_json(path)
    try:
        pixels = found["pixels"] and Quantiles(float(found["pixels"]["low"]), float(found["pixels"]["high"]))
        return FrozenScales(Scales({name: float(scale) for name, scale in found["scales"].items()}), pixels)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(
            f"{path}: does not hold the scales of a first round ({summarize_error(error)}); make it again"
        ) from error


def write_frozen_scales(
    path: Path | str, frozen: FrozenScales, scored: Scores, inputs: dict[str, Path | str | list], parameters: dict
) -> None:
    """Write scores.json: also how many candidates were scored, and by which terms."""
    facts = {"candidates": len(scored), "terms": list(scored.terms)}
    scales, pixels = frozen.scales.by_term, frozen.pixels and asdict(frozen.pixels)
    write_json(path, facts | {"scales": scales, "pixels": pixels, "provenance": record_provenance(inputs, parameters)})


@dataclass(frozen=True)
class PoseMaps:
    """Maps of n candidates. opacity: rendered uncertainty (1 - opacity, plus that of the Gaussians in view) of the
    whole picture, NaN below and beside a smaller picture. w2_sq: disagreement of the prior's samples in the picture's
    middle square; None without a prior. cells: pixels that show each cell of the ground (`coverage.CellViews`)."""

    names: list[str]
    opacity: Float32[Array, "n h w"]
    w2_sq: Float32[Array, "n hz wz"] | None
    cells: Float32[Array, "n cells"]


def apply_uncertainty(field: GaussianField, gaussians: Float32[Array, "g"]) -> GaussianField:
    """Replace the uncertainty of a field's first Gaussians. Inpainted ones keep theirs: the maps are older than
    they."""
    uncertainty, n = field.uncertainty.copy(), len(gaussians)
    uncertainty[:n] = np.where(field.imagined[:n], uncertainty[:n], gaussians)
    return replace(field, uncertainty=uncertainty)


def write_pose_maps(path: Path | str, maps: PoseMaps, gaussians: Float32[Array, "g"]) -> None:
    """Write maps (opacity in half precision) and the uncertainty of each Gaussian of the field."""
    values = {"names": np.array(maps.names, str), "opacity": maps.opacity.astype(np.float16), "gaussians": gaussians}
    values["cells"] = maps.cells
    if maps.w2_sq is not None:
        values["w2_sq"] = maps.w2_sq
    with atomic_file(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **values)


def read_pose_maps(path: Path | str) -> tuple[PoseMaps, Float32[Array, "g"]]:
    """Read maps and Gaussians' uncertainty. Raises: InputError: not such a file."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            w2_sq = stored.get("w2_sq")
            names = [str(name) for name in stored["names"]]
            maps = PoseMaps(names, stored["opacity"].astype(np.float32), w2_sq, stored["cells"])
            return maps, stored["gaussians"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not readable as maps of poses ({error}); make it again") from error
