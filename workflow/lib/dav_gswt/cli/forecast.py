"""What presets will be worth on a scene: from the measured table of presets, and from the scene's own photos.

Two things make a field's pictures wrong: the fit, and photos that were shrunk to the preset's size before it. So

    e(scene, preset) = b(scene) g(preset) + LACKING a(scene, preset)

with e the mean squared error of test photos at the table's size, b that of the baseline's fit, g a preset's fit against
it (the geometric mean over the scenes of the table), and a what shrinking takes from the photos, measured in them.
"""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images.image_files import enlarge_map, read_photo, shrink_image
from dav_gswt.images.metrics import mse_to_psnr

FRONT = Path("docs/research/data/preset_costs.csv")  # of a checkout: rule gather_preset_costs
BASELINE = "standard"  # preset that the others are compared with
LACKING = 0.7  # share of what shrinking takes that a field lacks: photos that overlap give some of it back
LEAST_SHARE = 0.1  # of an error, that is left to the fit whatever shrinking costs
LOOKED_AT = 6  # photos whose shrinking is measured


@dataclass(frozen=True)
class Measured:
    """A row of the table: a scene with a preset, tested at `size` pixels.

    shrinking: mean squared error of test photos shrunk to the preset's size and enlarged again; 0 where none is shrunk.
    estimated: seconds by `estimate` on the machine that the table was made on, beside `seconds`.
    """

    scene: str
    preset: str
    size: int
    psnr: float
    lpips: float
    shrinking: float
    gaussians: float
    bundle_mb: float
    seconds: float
    estimated: float

    @property
    def fit_error(self) -> float:
        """Mean squared error of the fit alone."""
        error = psnr_to_mse(self.psnr)
        return max(error - LACKING * self.shrinking, LEAST_SHARE * error)


@dataclass(frozen=True)
class Forecast:
    """psnr: dB, at the table's size. loss: dB under the best preset; lpips: over the best one."""

    preset: str
    psnr: float
    loss: float
    lpips: float


def read_front(path: Path | str = FRONT) -> list[Measured]:
    """Read the table of presets. Raises: InputError: it is not there, or lacks a column."""
    try:
        with Path(path).open(newline="", encoding="utf-8") as text:
            return [read_row(row) for row in csv.DictReader(text)]
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{path}: not the table of presets; `snakemake preset_costs` makes it ({error!r})") from error


def read_row(row: Mapping[str, Any]) -> Measured:
    """A row of the table, its numbers as text or numbers; NaN where one is missing. Raises: KeyError, ValueError."""
    about = ("scene", "preset", "size")
    numbers = {name: _read_number(row[name]) for name in Measured.__annotations__ if name not in about}
    return Measured(scene=str(row["scene"]), preset=str(row["preset"]), size=int(row["size"]), **numbers)


def _read_number(value: Any) -> float:
    return np.nan if value in (None, "") else float(value)


def forecast_presets(
    front: list[Measured], shrinking: Mapping[str, float], known: tuple[str, float] | None = None
) -> dict[str, Forecast]:
    """Forecast each preset of the table for a scene that is not in it.

    Args:    shrinking: what the scene's photos lose by each preset's size, mean squared error. known: a preset and the
             PSNR that the scene has with it, at the preset's own size; None: guessed from what photos lose; then losses
             hold better than levels.
    Returns: forecasts of the presets that both have; {} where the table lacks the baseline.
    """
    at = {(row.scene, row.preset): row for row in front}
    scenes = [scene for scene, preset in at if preset == BASELINE]
    fits = {
        preset: np.exp(np.mean(ratios))
        for preset in dict.fromkeys(row.preset for row in front)
        if (
            ratios := [np.log(at[s, preset].fit_error / at[s, BASELINE].fit_error) for s in scenes if (s, preset) in at]
        )
    }
    presets = [preset for preset in fits if preset in shrinking]
    if not presets:
        return {}
    base = psnr_to_mse(known[1]) / fits[known[0]] if known and known[0] in fits else _guess_error(front, shrinking)
    psnr = {p: error_to_psnr(base * fits[p] + LACKING * shrinking[p]) for p in presets}
    lpips = {p: _average_lpips(at, scenes, p, shrinking[p] > 0) for p in presets}
    best, sharpest = max(psnr.values()), min(lpips.values())
    return {p: Forecast(p, psnr[p], best - psnr[p], lpips[p] - sharpest) for p in presets}


def forecast_slowness(front: list[Measured], known: tuple[str, float | None] | None = None) -> dict[str, float]:
    """How many times as long as estimated each preset of the table takes: the geometric mean over its scenes.

    known: a preset and how many times as long as estimated the scene's run with it took; then all of them take longer
    by what that one did beyond the table's scenes. A preset without times takes as long as estimated.
    """
    found = {}
    for preset in dict.fromkeys(row.preset for row in front):
        logs = [np.log(row.seconds / row.estimated) for row in front if row.preset == preset]
        some = [value for value in logs if np.isfinite(value)]
        found[preset] = float(np.exp(np.mean(some))) if some else 1.0
    longer = known[1] / found[known[0]] if known and known[1] and known[0] in found else 1.0
    return {preset: longer * slowness for preset, slowness in found.items()}


@dataclass(frozen=True)
class LeftOut:
    """A scene of the table, forecast from the others: dB under its best preset, LPIPS over its best one, seconds."""

    scene: str
    preset: str
    loss: float
    measured_loss: float
    lpips: float
    measured_lpips: float
    seconds: float
    measured_seconds: float

    @property
    def late(self) -> float | None:
        """By how much too many seconds were forecast, as a share of the measured ones; None: they are not known."""
        share = self.seconds / self.measured_seconds - 1
        return share if np.isfinite(share) else None

    @property
    def off(self) -> float:
        """By how much too large a loss was forecast, dB."""
        return self.loss - self.measured_loss


def leave_one_out(front: list[Measured], known: str | None = None) -> list[LeftOut]:
    """Forecast every scene from the others. known: a preset that each scene was run with; None: without a run."""
    found = []
    for scene in dict.fromkeys(row.scene for row in front):
        own = {row.preset: row for row in front if row.scene == scene}
        level = (known, error_to_psnr(own[known].fit_error)) if known in own else None
        others = [row for row in front if row.scene != scene]
        made = forecast_presets(others, {preset: row.shrinking for preset, row in own.items()}, level)
        times = (known, own[known].seconds / own[known].estimated) if known in own else None
        slowness = forecast_slowness(others, times)
        best = max((own[preset].psnr for preset in made), default=0.0)
        sharpest = min((own[preset].lpips for preset in made), default=0.0)
        found += [
            LeftOut(
                *(scene, p, each.loss, best - own[p].psnr, each.lpips, own[p].lpips - sharpest),
                *(slowness[p] * own[p].estimated, own[p].seconds),
            )
            for p, each in made.items()
        ]
    return found


def _guess_error(front: list[Measured], shrinking: Mapping[str, float]) -> float:
    """The error of the baseline's fit: in proportion to what photos lose by shrinking, or the table's mean."""
    base = {row.scene: row.fit_error for row in front if row.preset == BASELINE}
    ratios = [
        np.log(base[row.scene] / row.shrinking)
        for row in front
        if row.shrinking > 0 and row.preset in shrinking and row.scene in base
    ]
    lost = [value for value in shrinking.values() if value > 0]
    if ratios and lost:
        return float(np.exp(np.mean(ratios) + np.mean(np.log(lost))))
    return float(np.exp(np.mean(np.log(list(base.values())))))


def _average_lpips(at: Mapping[tuple[str, str], Measured], scenes: list[str], preset: str, shrunk: bool) -> float:
    """Mean LPIPS over the baseline's, of scenes whose photos the preset shrinks alike; of all where there are none."""
    apart = {s: at[s, preset].lpips - at[s, BASELINE].lpips for s in scenes if (s, preset) in at}
    alike = [value for s, value in apart.items() if (at[s, preset].shrinking > 0) == shrunk]
    return float(np.mean(alike or list(apart.values())))


def measure_shrinking(photos: list[Path], sizes: Iterable[int], size: int) -> dict[int, float]:
    """Mean squared error of photos of `size` pixels (their own where that is less) shrunk to each of `sizes`.

    It is measured by enlarging them again, linearly between pixels, on some photos spread over all.
    """
    some = photos[:: max(1, -(-len(photos) // LOOKED_AT))]
    errors: dict[int, list[float]] = {each: [] for each in sizes}
    for path in some:
        photo = _fit_within(read_photo(path), size)
        for each, found in errors.items():
            found.append(_measure_loss(photo, each))
    return {each: float(np.mean(found)) if found else 0.0 for each, found in errors.items()}


def _measure_loss(photo: Float32[Array, "h w 3"], size: int) -> float:
    if max(photo.shape[:2]) <= size:
        return 0.0
    small, (height, width, _) = _fit_within(photo, size), photo.shape
    again = np.stack([enlarge_map(small[..., c], width, height) for c in range(3)], -1)
    return float(np.mean((again - photo) ** 2, dtype=np.float64))


def _fit_within(photo: Float32[Array, "h w 3"], size: int) -> Float32[Array, "h2 w2 3"]:
    height, width = photo.shape[:2]
    scale = size / max(height, width)
    return photo if scale >= 1 else shrink_image(photo, max(1, round(scale * width)), max(1, round(scale * height)))


def psnr_to_mse(psnr: float) -> float:
    """The mean squared error of a PSNR, of values in [0, 1]."""
    return 10 ** (-psnr / 10)


def error_to_psnr(mse: float) -> float:
    """The PSNR of a mean squared error; infinite where that is 0."""
    psnr = mse_to_psnr(mse)
    return np.inf if psnr is None else psnr
