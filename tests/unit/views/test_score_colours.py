"""Values by which candidates are coloured."""

import numpy as np

from dav_gswt.geometry.poses import Pose
from dav_gswt.views.score_colours import candidate_values
from dav_gswt.views.scores import Scores
from dav_gswt.views.uncertainty import Scales


def scored(**terms):
    poses = [Pose(f"p{i}", 45.0, 6.0 * i, 5.0) for i in range(60)]
    terms = {"coverage": np.linspace(0.0, 1.0, 60)} | terms
    return Scores(poses, terms, Scales({name: 0.5 for name in terms}), np.zeros(60, int))


def test_candidates_are_coloured_by_uncertainty_where_a_prior_was_sampled_else_by_coverage():
    label, values = candidate_values(scored(), 0.1)
    assert "coverage" in label
    np.testing.assert_allclose(values, np.linspace(0, 2, 60))  # over its scale of a half
    w2, lpips = np.linspace(1, 2, 60), np.linspace(5, 3, 60)
    label, values = candidate_values(scored(w2_sq=w2, lpips=lpips), 0.1)
    assert "W2 + 0.1 LPIPS" in label
    np.testing.assert_allclose(values, 2 * (w2 + 0.1 * lpips))
    assert "LPIPS" not in candidate_values(scored(w2_sq=w2), 0.1)[0]
    agreed = scored(w2_sq=np.zeros(60))
    agreed.scales.by_term["w2_sq"] = 0.0
    assert "coverage" in candidate_values(agreed, 0.0)[0]
