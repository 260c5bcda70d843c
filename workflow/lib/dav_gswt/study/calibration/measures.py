"""Does a score of a candidate pose say where the field is truly wrong? Of whole pictures, and of their pixels.

Scores are compared with the error of what the field shows there; `truth` says what it should have shown.
"""

import numpy as np
from jaxtyping import Bool, Float, Float32, Float64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.geometry.cameras import Camera
from dav_gswt.images import image_files, metrics
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.views.scoring import ground_mask
from dav_gswt.views.uncertainty import ause, calibrate_intervals, spearman

LEVEL = 0.9  # of the intervals
LEAST = 8  # poses, below which nothing is said
SPLITS = 200  # random halves of the poses: of 36 poses, 20 halves leave the coverage uncertain by 0.02
KNOWN = 0.5  # of a cell's pixels whose error must be known
PIXELS = 200_000  # of all poses together that are compared, at most

Maps = list[Float[Array, "_ _"]] | Float[Array, "n _ _"]
Judgement = dict[str, float | None]


def measure_errors(
    field: GaussianField, grid: Ground, views: list[TrainingView], size: int, corrected: bool = False
) -> tuple[Float64[Array, "n"], list[Float32[Array, "_ _"]]]:
    """RMSE between what the field shows and the true views, over the pixels that look at the modelled exemplar.

    Args:   size: longer side of the photos that the field was fitted to, pixels. The field is drawn that large, then
            shrunk: drawn small, its splats are blurred to a pixel's width and it is 0.04 off even where it is right.
            corrected: gain and offset of each channel are fitted to the view first (photos change their exposure).
    Returns: of each view the error (NaN where no pixel counts), and its map: root mean square over the channels, NaN
            where a pixel does not count.
    """
    error, maps = np.full(len(views), np.nan), []
    for i, view in enumerate(views):
        weight = view.weight * ground_mask(grid, view.camera)
        counts = weight > 0
        squares = np.full(counts.shape, np.nan)
        if counts.any():
            picture = _render_at_size(field, view.camera, size)
            if corrected:
                picture = np.clip(metrics.correct_colours(picture, view.image, weight), 0, 1)
            apart = picture[counts].astype(np.float64) - view.image[counts]
            squares[counts] = (apart**2).mean(-1)
            error[i] = np.sqrt(squares[counts].mean())
        maps.append(np.sqrt(squares).astype(np.float32))
    return error, maps


def _render_at_size(field: GaussianField, camera: Camera, size: int) -> Float32[Array, "h w 3"]:
    """What the field shows, drawn `size` pixels long, then shrunk to the camera's own."""
    width, height = camera.width, camera.height
    share = max(1.0, size / max(width, height))
    large = camera.resized(round(width * share), round(height * share))
    seen = np.clip(render(field, large).colour, 0, 1).astype(np.float32)
    return image_files.shrink_image(seen, width, height)


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
        low, high = calibrate_intervals(score[one], error[one], rng, level).at(score[other])
        inside.append(((low <= error[other]) & (error[other] <= high)).mean())
        width.append((high - low).mean())
    if not np.isfinite(width).all():
        return None, None
    return float(np.mean(inside)), float(np.mean(width))


def evaluate_pixels(maps: dict[str, Maps], error_maps: Maps) -> dict[str, Judgement]:
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
    maps: dict[str, Maps],
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
