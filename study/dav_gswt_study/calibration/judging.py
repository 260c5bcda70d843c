"""Collects scores of candidates and the true error there, and compares them with `agreement`."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64
from numpy import ndarray as Array

from dav_gswt.field import GaussianField, read_field
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.poses import Pose, pose_of_camera, pose_offset, select_farthest_poses
from dav_gswt.geometry.scene_frame import SceneFrame, read_scene_frame
from dav_gswt.images import image_files, metrics
from dav_gswt.photos.training_views import WHOLE, TrainingView, read_training_views
from dav_gswt.photos.view_split import ViewSplit
from dav_gswt.raster import render
from dav_gswt.reconstruction.ground import Ground, read_ground
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.scores import PoseMaps, Scores
from dav_gswt.views.scoring import PHOTO_WIDTH, ground_mask, scoring_camera
from dav_gswt.views.uncertainty import combine_terms
from dav_gswt_study.calibration import agreement


@dataclass(frozen=True)
class CalibrationTarget:
    """The field whose scores are compared. taken: the photos so far. size: longer side of the photos of its fit."""

    field: GaussianField
    grid: Ground
    frame: SceneFrame
    taken: list[TrainingView]
    size: int


def read_target(given, split: ViewSplit, captures: list[str], size: int) -> CalibrationTarget:
    """Read the target. given: files `field`, `ground`, `frame`, `images`, `model`. captures: of earlier rounds."""
    taken = read_training_views(given.images, given.model, split.start, captures, PHOTO_WIDTH)
    field, grid = read_field(given.field), read_ground(given.ground)
    return CalibrationTarget(field, grid, read_scene_frame(given.frame), taken, size)


def calibrate_scores(
    judged: CalibrationTarget,
    some: Candidates,
    views: list[TrainingView],
    scored: tuple[Scores, PoseMaps],
    lam: float,
    seed: int,
) -> tuple[dict, list[dict]]:
    """Compare scores with true errors. Returns the content of calibration.json, and a row per candidate.

    some, views: candidates and their true pictures. scored: scores and maps. lam: weight of LPIPS in u.
    """
    row = {name: i for i, name in enumerate(scored[0].names)}
    terms, shown = _select_terms(*scored, [row[pose.name] for pose, _ in some], lam)
    terms |= geometric_baselines(
        [pose for pose, _ in some], [pose_of_camera("", v.camera, judged.frame) for v in judged.taken]
    )
    corrected = judged.frame.kind == "photos"  # photos differ in exposure
    error, error_maps = measure_errors(judged.field, judged.grid, views, judged.size, corrected)
    table = [
        {"pose": pose.name, "error": error[i]} | {name: values[i] for name, values in terms.items()}
        for i, (pose, _) in enumerate(some)
    ]
    return agreement.summarise(terms, shown, error, error_maps, seed), table


def choose_candidates(
    candidates: Candidates, scored: Scores, images: Path | str, count: int
) -> tuple[Candidates, list[TrainingView]]:
    """Choose `count` candidates of a replayed scene, or all, spread over the scored ones.

    images: the folder of the photos. Returns: the candidates, and their photos at the scoring size.
    """
    names = set(scored.names)
    known = [(pose, camera) for pose, camera in candidates if pose.name in names]
    some = [known[i] for i in select_farthest_poses([pose for pose, _ in known], count)]
    return some, [_read_photo(pose, camera, images) for pose, camera in some]


def _read_photo(pose: Pose, camera: Camera, images: Path | str) -> TrainingView:
    """The photo of a candidate at the scoring size; weight 0 where it is masked."""
    image, cover = image_files.read_photo_and_alpha(Path(images) / pose.name)
    camera = scoring_camera(camera)
    size = camera.width, camera.height
    weight = image_files.shrink_image(cover[..., None], *size)[..., 0] > WHOLE
    return TrainingView(pose.name, camera, image_files.shrink_image(image, *size), weight.astype(np.float32))


def geometric_baselines(some: list[Pose], taken: list[Pose]) -> dict[str, Float64[Array, "n"]]:
    """Baseline scores: `low`, degrees below the zenith, and `far`, distance to the nearest photo."""
    at, photos = (np.array([pose_offset(pose) for pose in poses]).reshape(-1, 3) for poses in (some, taken))
    apart = np.linalg.norm(at[:, None] - photos, axis=-1).min(1, initial=np.inf)
    return {"low": np.array([90.0 - pose.elevation for pose in some]), "far": apart}


def _select_terms(
    scores: Scores, maps: PoseMaps, rows: list[int], lam: float
) -> tuple[dict[str, Float64[Array, "n"]], dict[str, Float32[Array, "n _ _"]]]:
    """Terms and maps of some rows; with a prior u is among the terms."""
    terms = {name: values[rows] for name, values in scores.terms.items()}
    shown = {"opacity": maps.opacity[rows]}
    if "w2_sq" in scores.terms:
        assert maps.w2_sq is not None  # it is written beside the term
        u = combine_terms(scores.term("w2_sq"), scores.terms.get("lpips"), lam, scores.scales)
        terms, shown = terms | {"u": u[rows]}, shown | {"w2_sq": maps.w2_sq[rows]}
    return terms, shown


def measure_errors(
    field: GaussianField, grid: Ground, views: list[TrainingView], size: int, corrected: bool = False
) -> tuple[Float64[Array, "n"], list[Float32[Array, "_ _"]]]:
    """Measure the RMSE between renders and true views, over the pixels that look at the modelled exemplar.

    Args:   size: longer side of the photos that the field was fitted to, pixels. The field is rendered at that size,
            then shrunk; at a smaller size splats are blurred to a pixel's width.
            corrected: fit gain and offset of each channel to the view first (photos differ in exposure).
    Returns: of each view the error (NaN where no pixel counts), and its map: root mean square over the channels, NaN
            where a pixel does not count.
    """
    error, maps = np.full(len(views), np.nan), []
    for i, view in enumerate(views):
        weight = view.weight * ground_mask(grid, view.camera)
        mask = weight > 0
        squares = np.full(mask.shape, np.nan)
        if mask.any():
            picture = _render_at_size(field, view.camera, size)
            if corrected:
                picture = np.clip(metrics.correct_colours(picture, view.image, weight), 0, 1)
            apart = picture[mask].astype(np.float64) - view.image[mask]
            squares[mask] = (apart**2).mean(-1)
            error[i] = np.sqrt(squares[mask].mean())
        maps.append(np.sqrt(squares).astype(np.float32))
    return error, maps


def _render_at_size(field: GaussianField, camera: Camera, size: int) -> Float32[Array, "h w 3"]:
    """Render the field `size` pixels long, then shrink it to the camera's size."""
    width, height = camera.width, camera.height
    share = max(1.0, size / max(width, height))
    large = camera.resized(round(width * share), round(height * share))
    seen = np.clip(render(field, large).colour, 0, 1).astype(np.float32)
    return image_files.shrink_image(seen, width, height)
