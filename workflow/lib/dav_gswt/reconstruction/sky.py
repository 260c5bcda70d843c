"""The sky: the background of rays that miss the ground, against which low photos carve objects out.

Its colours by direction are spherical harmonics of degree 3, one sky for all photos, fitted by least absolute
deviations, so that objects before it have no influence. A pixel above the horizon with the sky's colour sees through
everything: it counts, with the sky behind the field. Other pixels may show an object or a far hill that is not
modelled: they do not count.
"""

import logging

import numpy as np
from jaxtyping import Bool, Float, Float32
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation

from dav_gswt.photos.training_views import TrainingView, one_by_one
from dav_gswt.raster import harmonics

_log = logging.getLogger(__name__)

DEGREE = 3
MIN_PIXELS = 2000  # above the horizon, of all photos, to fit a sky
MAX_PIXELS = 50_000  # of them that are used, evenly over the photos
ROUNDS = 12  # of reweighting
RIDGE = 1e-3  # regularises directions that no photo shows
TRIM, SLACK = 3.0, 0.02  # a pixel is sky within TRIM median deviations plus SLACK
MAX_DEVIATION = 0.08  # median deviation, above which there is no single sky: broken clouds, trees all around
EDGE = 2  # pixels around objects against the sky that are ignored


def add_sky(views: list[TrainingView], modelled: list[TrainingView]) -> list[TrainingView]:
    """The modelled views with the sky as background, where they see it.

    views: the photos, counting wherever they are valid. modelled: the same, counting only over the ground.
    Without enough sky, or without a smooth one, the modelled views are returned.
    """
    counts = [int(_pixels_above_horizon(view).sum()) for view in one_by_one(views)]
    total = sum(counts)
    if total < MIN_PIXELS:
        return modelled
    coefficients, deviation = fit_sky(*_sample_sky(views, counts, max(1, total // MAX_PIXELS)))
    if deviation > MAX_DEVIATION:
        _log.info("sky: none that is smooth (its pixels differ by %.2f), it counts for nothing", deviation)
        return modelled
    bound = TRIM * 1.4826 * deviation + SLACK
    pairs = zip(one_by_one(modelled), views, strict=True)
    found = [_mask_sky(m, view, *_rays_above_horizon(view), coefficients, bound) for m, view in pairs]
    seen = sum(int((~np.isnan(v.behind[..., 0])).sum()) for v in one_by_one(found) if v.behind is not None)
    _log.info("sky: %.0f %% of what lies above the horizon", 100 * seen / total)
    return found


def _sample_sky(
    views: list[TrainingView], counts: list[int], stride: int
) -> tuple[Float[Array, "n 3"], Float32[Array, "n 3"]]:
    """Directions and colours of every `stride`-th of the pixels above the horizon, of all photos in their order."""
    directions, colours, before = [], [], 0
    for view, count in zip(one_by_one(views), counts, strict=True):
        towards, rising = _rays_above_horizon(view)
        some = np.s_[-before % stride :: stride]
        directions.append(towards[rising][some])
        colours.append(view.image[rising][some])
        before += count
    return np.concatenate(directions), np.concatenate(colours)


def fit_sky(directions: Float[Array, "n 3"], colours: Float32[Array, "n 3"]) -> tuple[Float[Array, "16 3"], float]:
    """Coefficients of the sky with the least absolute deviation, and the median deviation.

    Sums are in one order: those of BLAS depend on the number of its threads.
    """
    basis = harmonics.basis(directions, DEGREE)
    weight, residual = np.ones(len(basis)), np.zeros(len(basis))
    coefficients = np.zeros((basis.shape[1], 3))
    ridge = RIDGE * len(basis) * np.diag([0.0] + [1.0] * (basis.shape[1] - 1))
    for _ in range(ROUNDS):
        weighted = basis * weight[:, None]
        squares = np.einsum("nk,nl->kl", weighted, basis) + ridge * weight.mean()
        coefficients = np.linalg.solve(squares, np.einsum("nk,nc->kc", weighted, colours))
        residual = np.abs(np.einsum("nk,kc->nc", basis, coefficients) - colours).max(1)
        weight = 1 / np.maximum(residual, 0.01)
    return coefficients, float(np.median(residual))


def _rays_above_horizon(view: TrainingView) -> tuple[Float[Array, "h w 3"], Bool[Array, "h w"]]:
    """Unit directions of a view's rays, and which of them are above the horizon and count."""
    _, step = view.camera.rays()
    return step / np.linalg.norm(step, axis=-1, keepdims=True), _pixels_above_horizon(view)


def _pixels_above_horizon(view: TrainingView) -> Bool[Array, "h w"]:
    """Which pixels count and look upwards, by the height of the rays alone: most photos have none."""
    camera = view.camera
    across = (np.arange(camera.width) + 0.5 - camera.cx) / camera.fx
    down = (np.arange(camera.height) + 0.5 - camera.cy) / camera.fy
    x, y, z = camera.rotation[:, 2]  # the world's up, as the camera sees it
    return (across * x + (down * y)[:, None] + z > 0) & (view.weight > 0)


def _mask_sky(
    modelled: TrainingView, view: TrainingView, directions, rising, coefficients, bound: float
) -> TrainingView:
    sky = np.full(view.image.shape, np.nan, np.float32)
    sky[rising] = np.clip(np.einsum("nk,kc->nc", harmonics.basis(directions[rising], DEGREE), coefficients), 0, 1)
    with np.errstate(invalid="ignore"):
        agrees = rising & (np.abs(sky - view.image).max(-1) <= bound)
    other = rising & ~agrees
    sees = agrees & ~binary_dilation(other, iterations=EDGE) if other.any() else agrees
    sky[~sees] = np.nan
    return modelled.with_pixels(behind=sky, weight=np.where(sees, view.weight, modelled.weight))
