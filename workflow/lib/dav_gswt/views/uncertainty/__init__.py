"""Uncertainty of a view from samples of a prior.

`disagreement` and `texture` compute its terms, `weighting` combines them, `calibration` compares scores with errors.
"""

from dav_gswt.views.uncertainty.calibration import Intervals, ause, calibrate_intervals, conformal_quantile, spearman
from dav_gswt.views.uncertainty.disagreement import w2_sq, w2_sq_as_printed, w2_sq_by_pairs
from dav_gswt.views.uncertainty.texture import gradient_map, image_gradient
from dav_gswt.views.uncertainty.weighting import (
    Quantiles,
    Scales,
    combine_image_terms,
    combine_terms,
    gamma,
    normalise,
    robust_scale,
)

__all__ = [
    "Intervals",
    "Quantiles",
    "Scales",
    "ause",
    "calibrate_intervals",
    "combine_terms",
    "combine_image_terms",
    "conformal_quantile",
    "gamma",
    "gradient_map",
    "image_gradient",
    "normalise",
    "robust_scale",
    "spearman",
    "w2_sq",
    "w2_sq_as_printed",
    "w2_sq_by_pairs",
]
