"""The uncertainty of a view, by what a prior imagines there: its terms, how they are weighed, how far to trust them.

`disagreement` and `texture` make the terms, `weighing` puts them together, `calibration` compares them with errors.
"""

from dav_gswt.views.uncertainty.calibration import Intervals, ause, calibrated, conformal_quantile, spearman
from dav_gswt.views.uncertainty.disagreement import w2_sq, w2_sq_as_printed, w2_sq_by_pairs
from dav_gswt.views.uncertainty.texture import gradient_map, image_gradient
from dav_gswt.views.uncertainty.weighting import (
    Quantiles,
    Scales,
    combined,
    combined_image,
    gamma,
    normalised,
    robust_scale,
)

__all__ = [
    "Intervals",
    "Quantiles",
    "Scales",
    "ause",
    "calibrated",
    "combined",
    "combined_image",
    "conformal_quantile",
    "gamma",
    "gradient_map",
    "image_gradient",
    "normalised",
    "robust_scale",
    "spearman",
    "w2_sq",
    "w2_sq_as_printed",
    "w2_sq_by_pairs",
]
