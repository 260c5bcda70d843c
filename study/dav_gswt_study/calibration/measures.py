"""Agreement of scores with the true error of the field, over whole pictures and over their pixels."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt.images import image_files
from dav_gswt_study.calibration.agreement import ause, calibrate_intervals, spearman

LEVEL = 0.9  # of the intervals
LEAST = 8  # poses needed for a result
SPLITS = 200  # random halves of the poses over which coverage is averaged
KNOWN = 0.5  # share of a cell's pixels whose error must be known
PIXELS = 200_000  # compared at most, over all poses

Maps = list[Float[Array, "_ _"]] | Float[Array, "n _ _"]
Judgement = dict[str, float | None]


def evaluate_scores(
    scores: dict[str, Float[Array, "n"]], error: Float[Array, "n"], seed: int, level: float = LEVEL
) -> dict[str, Judgement]:
    """Of each score of n poses: `spearman`, `ause`, and `coverage` and mean `width` of split-conformal intervals.

    `ause_chance` is the AUSE of a score that says nothing. Intervals are calibrated on a random half of the poses and
    tried on the other, SPLITS times, by the same halves for every score. They are None where a half has too few poses
    for the level (fewer than 34 at 0.9). All is None of fewer than LEAST poses, or where score or error is constant.
    Raises: ValueError: a value that is not finite, a level outside (0, 1).
    """
    found = {}
    for name, score in scores.items():
        found[name] = dict.fromkeys(("spearman", "ause", "ause_chance", "coverage", "width"))
        if len(error) >= LEAST and (rank := spearman(score, error)) is not None:
            coverage, width = _intervals(score, error, seed, level)
            areas = {"ause": ause(score, error), "ause_chance": ause(np.zeros(len(error)), error)}
            found[name] = {"spearman": rank, **areas, "coverage": coverage, "width": width}
    return found


def _intervals(
    score: Float[Array, "n"], error: Float[Array, "n"], seed: int, level: float
) -> tuple[float | None, float | None]:
    """How many of the poses left out lie in their intervals, and how wide these are, in units of the error."""
    inside, width = [], []
    for split in range(SPLITS):
        rng = np.random.default_rng([seed, split])
        order = rng.permutation(len(error))
        one, other = order[: len(error) // 2], order[len(error) // 2 :]
        low, high = calibrate_intervals(score[one], error[one], rng, level).bounds(score[other])
        inside.append(((low <= error[other]) & (error[other] <= high)).mean())
        width.append((high - low).mean())
    if not np.isfinite(width).all():
        return None, None
    return float(np.mean(inside)), float(np.mean(width))


def evaluate_pixels(maps: Mapping[str, Maps], error_maps: Maps) -> dict[str, Judgement]:
    """Of each kind of map: `pixel_spearman` and `pixel_ause` over the pixels of all poses whose error is known.

    A map as wide as its picture is of the whole of it (rows below a lower picture are left out), any other one of its
    middle square: there the error is the mean over a cell of the map. `pixel_ause_chance`: see `evaluate_scores`. Over
    PIXELS are thinned out evenly. None where no pixel is known, or score or error is constant.
    Raises: ValueError: a map that is not finite where the error is known, or finer than its picture.
    """
    found = {}
    for name, own in maps.items():
        pairs = [_known_pixels(score, error) for score, error in zip(own, error_maps, strict=True)]
        score, error = np.concatenate([np.zeros((2, 0)), *pairs], axis=1)
        step = max(1, -(-len(error) // PIXELS))
        score, error = score[::step], error[::step]
        found[name] = dict.fromkeys(("pixel_spearman", "pixel_ause", "pixel_ause_chance"))
        if (rank := spearman(score, error)) is not None:
            chance = ause(np.zeros(len(error)), error)
            found[name] = {"pixel_spearman": rank, "pixel_ause": ause(score, error), "pixel_ause_chance": chance}
    return found


def _known_pixels(score: Float[Array, "_ _"], error: Float[Array, "_ _"]) -> Float64[Array, "2 pixels"]:
    """Score and error of the pixels, or cells, whose error is known."""
    height, width = error.shape
    if score.shape[1] == width and score.shape[0] >= height:
        score = score[:height]
    else:
        error = average_cells(error, *score.shape)
    known: Bool[Array, "h w"] = np.isfinite(error)
    return np.stack([score[known], error[known]]).astype(np.float64)


def average_cells(error_map: Float[Array, "h w"], rows: int, columns: int) -> Float32[Array, "{rows} {columns}"]:
    """Mean error in each cell of a map of the picture's middle square; NaN where less than half of a cell is known.

    Raises: ValueError: cells smaller than pixels.
    """
    side = min(error_map.shape)
    top, left = ((length - side) // 2 for length in error_map.shape)
    square = error_map[top : top + side, left : left + side]
    known = np.isfinite(square)
    parts = np.stack([np.where(known, square, 0), known], -1).astype(np.float32)
    total, share = np.moveaxis(image_files.shrink_image(parts, columns, rows), -1, 0)
    enough = share > KNOWN - 1e-6  # sums of parts of pixels round
    return np.where(enough, total / np.where(enough, share, 1), np.nan).astype(np.float32)


def summarise(
    scores: dict[str, Float[Array, "n"]],
    maps: Mapping[str, Maps],
    error: Float[Array, "n"],
    error_maps: Maps,
    seed: int,
    level: float = LEVEL,
) -> dict:
    """The content of calibration.json, of the poses whose error is known. maps: of those scores that have one."""
    seen = np.flatnonzero(~np.isnan(error))
    found = evaluate_scores({name: score[seen] for name, score in scores.items()}, error[seen], seed, level)
    pixels = evaluate_pixels(
        {name: [own[i] for i in seen] for name, own in maps.items()}, [error_maps[i] for i in seen]
    )
    return {
        "poses": len(seen),
        "error_mean": float(error[seen].mean()) if len(seen) else None,
        "level": level,
        "scores": {name: found[name] | pixels.get(name, {}) for name in scores},
    }
