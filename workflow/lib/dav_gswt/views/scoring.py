"""Scoring of candidate poses: how uncertain the field is in what a camera would see there, and samples of a prior."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int
from numpy import ndarray as Array

from dav_gswt.field import GaussianField
from dav_gswt.files import locate_path
from dav_gswt.geometry.cameras import Camera
from dav_gswt.geometry.scene_frame import SceneFrame
from dav_gswt.images.image_files import enlarge_map
from dav_gswt.images.lpips_weights import Weights, read
from dav_gswt.logs import progress
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.prior import interface
from dav_gswt.prior.interface import Condition, Prior
from dav_gswt.raster import make_rasterizer, to_raster_arrays
from dav_gswt.reconstruction.ground import Ground
from dav_gswt.reconstruction.top_view import render_top_view
from dav_gswt.threads import default_threads, map_in_single_threads
from dav_gswt.views import terms
from dav_gswt.views.candidates import Candidates
from dav_gswt.views.coverage import GroundCells
from dav_gswt.views.scores import FrozenScales, PoseMaps, Scores
from dav_gswt.views.terms import Renders, compute_terms
from dav_gswt.views.uncertainty import Quantiles, Scales, normalise, require_finite, w2_sq

BATCH = 4  # poses sampled at a time: as fast as more at once, and few enough that every thread has some
SampledTerms = dict[str, Array]  # by name the terms of poses, row by row, and `maps` of w2_sq, in cells of the latents
WIDTH = 96  # pixels along the longer side of a picture for scoring
PHOTO_WIDTH = 384  # pixels across a captured photo that conditions a prior, before cropping and shrinking
UNSEEN = 0.99  # uncertainty of a Gaussian from which on no photo so far shows it
SIDE = 64  # pixels of the pictures from which blend weights are computed
SEEN = 0.05  # total blend weight, in pixels, from which a Gaussian counts as seen


@dataclass(frozen=True)
class PriorConfig:
    """A prior and its sampling settings.

    samples: per pose. steps: of denoising. p_drop: attention dropout. weights: of LPIPS; None leaves its terms out.
    """

    model: Prior
    samples: int
    steps: int
    p_drop: float
    seed: int = 0
    weights: Weights | None = None


def open_prior(entry: dict, p_drop: float, seed: int, lpips_file: Path | str | None = None) -> PriorConfig:
    """Open an entry of `priors` of the config. lpips_file: weights of LPIPS; None leaves its terms out.

    Raises: InputError: weights of the prior or of LPIPS are missing or invalid.
    """
    weights = None if lpips_file is None else read(lpips_file)
    return PriorConfig(load_prior(entry), entry["samples"], entry["steps"], p_drop, seed, weights)


def load_prior(entry: dict) -> Prior:
    """Load the model of an entry of `priors`. Raises: InputError: its weights are missing or invalid."""
    if entry["model"] == "terrain":
        from dav_gswt.prior.terrain import TerrainPrior  # not above: diffusers takes seconds to load
        from dav_gswt.prior.weights import TERRAIN_WEIGHTS

        return TerrainPrior.open(locate_path(entry.get("weights", TERRAIN_WEIGHTS)))
    from dav_gswt.prior.zero123 import Zero123

    return Zero123.open(locate_path(entry["weights"]))


def sample_terms(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "n s s"]
) -> SampledTerms:
    """Compute the terms of every pose.

    masks: 1 for pixels that look at the modelled ground. w2_sq is the mean over these (0 if there are none), and LPIPS
    sees only these; maps and gradient are of the whole picture.
    Raises: ValueError: fewer than 2 samples, p_drop outside [0, 1), something not finite, naming the poses.
    """
    parts = [np.arange(len(condition))[i : i + BATCH] for i in range(0, len(condition), BATCH)]

    def worker(own: PriorConfig) -> Callable[[Int[Array, "b"]], SampledTerms]:
        return lambda r: _sample_batch(own, condition[r], [names[i] for i in r], masks[r])

    more = min(default_threads(), len(parts)) - 1 if prior.model.small else 0
    own = [prior, *(replace(prior, model=deepcopy(prior.model)) for _ in range(more))]
    made = map_in_single_threads([worker(each) for each in own], parts)
    found = [part for _, part in zip(progress(parts, "sample poses"), made, strict=True)]
    return {name: np.concatenate([part[name] for part in found]) for name in found[0]}


def _sample_batch(
    prior: PriorConfig, condition: Condition, names: list[str], masks: Float32[Array, "k s s"]
) -> SampledTerms:
    latents = prior.model.sample(condition, prior.samples, prior.p_drop, prior.steps, prior.seed)
    maps, pictures = w2_sq(latents, names=names)[1], prior.model.decode(latents)[..., :3]
    drawn = terms.Samples(condition, maps, pictures, masks, prior.weights, prior.p_drop == 0)
    return terms.compute_terms(drawn) | {"maps": maps}


@dataclass(frozen=True)
class ScoringResult:
    """Result of a scoring. gaussians: uncertainty of each Gaussian of the field, in [0, 1]."""

    scores: Scores
    maps: PoseMaps
    frozen: FrozenScales
    gaussians: Float32[Array, "gaussians"]


def render_above(result: ScoringResult, field: GaussianField, grid: Ground) -> Float32[Array, "rows columns"]:
    """The uncertainty of the field from straight above, rows from north to south as in EXR files."""
    return render_top_view(replace(field, uncertainty=result.gaussians), grid).uncertainty[::-1]


def scoring_camera(camera: Camera) -> Camera:
    """A candidate's camera at the scoring size: its longer side has WIDTH pixels."""
    longer = max(camera.width, camera.height)
    return camera.resized(*(max(1, round(WIDTH * side / longer)) for side in (camera.width, camera.height)))


def score_poses(
    field: GaussianField,
    grid: Ground,
    candidates: Candidates,
    taken: list[TrainingView],
    frame: SceneFrame,
    prior: PriorConfig | None = None,
    frozen: FrozenScales | None = None,
) -> ScoringResult:
    """Score every candidate: opacity and gain in coverage, with a prior also its terms, and maps.

    taken: the photos so far. prior: None for geometric terms only. frozen: of the first round; None in the first round.
    """
    renders = _render_candidates(field, grid, candidates, [scoring_camera(v.camera) for v in taken])
    terms, w2_sq = compute_terms(renders), None
    poses, names = [pose for pose, _ in candidates], [pose.name for pose, _ in candidates]
    if prior is not None and candidates:
        condition, masks = build_conditions(field, grid, candidates, taken, frame, prior.model.size)
        sampled = sample_terms(prior, condition, names, masks)
        w2_sq = sampled.pop("maps")
        terms |= {name: values.astype(np.float64) for name, values in sampled.items()}
    for name, values in terms.items():
        require_finite(values, name, names)
    if frozen is None:
        quantiles = None if w2_sq is None else Quantiles.from_values(w2_sq.ravel())
        frozen = FrozenScales(Scales.from_terms(terms), quantiles)
    maps = PoseMaps(names, _stack_maps(renders.uncertainty), w2_sq, renders.seen.pixels)
    gaussians = _gaussian_uncertainty(field, candidates, w2_sq, frozen)
    return ScoringResult(Scores(poses, terms, frozen.scales), maps, frozen, gaussians)


def build_conditions(
    field: GaussianField, grid: Ground, candidates: Candidates, taken: list[TrainingView], frame: SceneFrame, size: int
) -> tuple[Condition, Float32[Array, "n s s"]]:
    """Build the conditions of a prior at the candidates, and masks of pixels that look at the modelled ground (1).

    What no photo shows is left out of the renders: the field there is a smooth guess, which a prior takes as seen.
    """
    known, shown = interface.prepare_photos(taken, frame, size), field[np.flatnonzero(field.uncertainty < UNSEEN)]
    squares = [interface.crop_camera(camera).resized(size, size) for _, camera in candidates]
    masks = np.stack([ground_mask(grid, camera) for camera in squares])
    return interface.build_condition(shown, candidates, known, frame.flying_height, size), masks


def _render_candidates(field: GaussianField, grid: Ground, candidates: Candidates, taken: list[Camera]) -> Renders:
    """One render a candidate: its rendered uncertainty, and the pixels that show each cell of the ground.

    The uncertainty of a pixel is blend-weighted, plus the transmittance.
    """
    raster, cells = make_rasterizer(), GroundCells(field, grid)
    cameras = [scoring_camera(camera) for _, camera in candidates]
    maps, pixels = [], []
    arrays = to_raster_arrays(field, field.uncertainty[:, None])
    for seen in raster.forward_each(arrays, progress(cameras, "score poses")):
        maps.append(np.clip(seen.colour[..., 0] + 1 - seen.alpha, 0, 1))  # nothing is known where light passes
        pixels.append(cells.count_pixels(raster))
    masks = [ground_mask(grid, camera) for camera in cameras]
    return Renders(maps, masks, cells, cells.gather_views(cameras, pixels), cells.view(taken))


def _stack_maps(maps: list[Float32[Array, "_ _"]]) -> Float32[Array, "n h w"]:
    """Maps as one array, with NaN below and beside smaller ones."""
    shape = (0, 1, 1) if not maps else (len(maps), *np.max([m.shape for m in maps], axis=0))
    out = np.full(shape, np.nan, np.float32)  # cameras of the candidates may differ in their size
    for i, m in enumerate(maps):
        out[i, : m.shape[0], : m.shape[1]] = m
    return out


def ground_mask(grid: Ground, camera: Camera) -> Float32[Array, "h w"]:
    """Mask (1) of the pixels that look at the modelled ground."""
    shape = camera.height, camera.width
    blank = TrainingView("", camera, np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32))
    return mask_outside_ground(blank, *grid.judged).weight


def _gaussian_uncertainty(
    field: GaussianField, candidates: Candidates, w2_sq: Float32[Array, "n h w"] | None, frozen: FrozenScales
) -> Float32[Array, "gaussians"]:
    """Uncertainty of each Gaussian from the prior's maps; geometric where no candidate sees it, or without a prior."""
    if w2_sq is None or frozen.pixels is None:
        return field.uncertainty
    cameras = [interface.crop_camera(camera) for _, camera in candidates]
    backprojected = backproject_maps(field, cameras, normalise(w2_sq, frozen.pixels))
    return np.where(np.isnan(backprojected), field.uncertainty, backprojected).astype(np.float32)


def backproject_maps(
    field: GaussianField, cameras: list[Camera], maps: Float32[Array, "n h w"]
) -> Float32[Array, "gaussians"]:
    """Mean of u over cameras and pixels, weighted by blend weight: sum of w_i(p) u(p) / sum of w_i(p).

    cameras: of square pictures, which the maps cover at any resolution. Rendered like a colour, the result gives the
    uncertainty of any other view. Returns: NaN for Gaussians that are not seen.
    """
    raster = make_rasterizer()
    total = np.zeros((2, len(field)))
    small = [camera.resized(SIDE, SIDE) for camera in cameras]
    for u, _ in zip(maps, raster.forward_each(to_raster_arrays(field), small), strict=True):
        found = raster.contributions(enlarge_map(u, SIDE, SIDE)[..., None])
        total += found.mapped[:, 0], found.total
    weighted, weight = total
    return np.where(weight > SEEN, weighted / np.maximum(weight, SEEN), np.nan).astype(np.float32)
