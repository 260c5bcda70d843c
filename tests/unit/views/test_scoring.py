"""Scores of poses over a small ground, with a prior whose samples disagree by a known amount."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.views import coverage, pose_maps, scores, scoring
from dav_gswt.views.prior_sampling import PriorConfig
from dav_gswt.views.scores import FrozenScales
from dav_gswt.views.scoring import backproject_maps
from dav_gswt.views.terms import TERMS
from dav_gswt.views.uncertainty import Quantiles, Scales

MIDDLE = [1.6, 1.6, 0.0]


class KnownDisagreement:
    """Samples that disagree where the render is blue, and by how much; pictures are the latents themselves."""

    name, size, small = "known disagreement", 32, False

    def sample(self, condition, m, p_drop, steps, seed, common=True):
        blue = condition.colour[..., 2]
        signs = np.where(np.arange(m) % 2, -1.0, 1.0)[None, :, None, None, None]
        return (p_drop * signs * blue[:, None, None]).repeat(4, 2).astype(np.float32)

    def decode(self, latents):
        pictures = np.clip(0.5 + latents, 0, 1).transpose(0, 1, 3, 4, 2)
        return np.ascontiguousarray(pictures)


class Blind(KnownDisagreement):
    def decode(self, latents):
        return np.nan * super().decode(latents)


def pool(*eyes, width=40, height=40):
    found = []
    for i, eye in enumerate(eyes or ([1.6, 1.6, 5.0], [4.0, 1.6, 4.0], [1.6, 4.5, 4.0])):
        camera = cameras.pinhole(eye, MIDDLE, width, height, 40.0)
        found.append((pose_of_camera(f"p{i}", camera, patch.FRAME), camera))
    return found


def scored(prior=None, **more):
    return scoring.score_poses(patch.field(), patch.grid(), pool(), patch.photos(), patch.FRAME, prior, **more)


def test_w2_is_the_disagreement_of_the_samples_over_the_frozen_scale():
    still, dropped = (scored(PriorConfig(KnownDisagreement(), 2, 4, p)) for p in (0.0, 0.2))
    assert not still.scores.terms["w2_sq"].any() and still.scores.scales.by_term["w2_sq"] == 0
    # two samples at +-d in four channels: 2 var(ddof=1) summed is 4 (2 d)^2, and d is .2 of a blue of about .4
    np.testing.assert_allclose(dropped.scores.terms["w2_sq"][0], 4 * (2 * 0.2 * 0.4) ** 2, rtol=0.2)
    assert dropped.maps.w2_sq.shape == (3, 32, 32)
    assert "lpips" not in dropped.scores.terms
    with pytest.raises(ValueError, match="not finite: gradient of pose p0, p1, p2"):
        scored(PriorConfig(Blind(), 2, 4, 0.2))
    first = FrozenScales(Scales(dict.fromkeys(TERMS, 7.0)), Quantiles(0.0, 1.0))  # of an earlier round
    assert scored(PriorConfig(KnownDisagreement(), 2, 4, 0.2), frozen=first).scores.scales == first.scales


def test_a_gaussian_gets_the_uncertainty_of_the_pixels_that_it_covers():
    field, (_, camera) = patch.field(), pool()[0]
    half = np.zeros((16, 16), np.float32)
    half[:, :8] = 1
    found = backproject_maps(field, [camera], half[None])
    column = camera.project(field.means.astype(float))[0][:, 0]
    drawn = np.isfinite(found)
    assert found[drawn & (column < 0.4 * 40)].min() > 0.95 and found[drawn & (column > 0.6 * 40)].max() < 0.05
    one = backproject_maps(field, [camera], np.full((1, 16, 16), 0.25, np.float32))
    np.testing.assert_allclose(one[drawn], 0.25, rtol=1e-5)
    # those that no candidate sees keep their geometric uncertainty
    field = replace(patch.field(), uncertainty=np.full(len(patch.field()), 0.3, np.float32))
    tele = cameras.pinhole([0.3, 0.3, 5.0], [0.3, 0.3, 0.0], 40, 40, 4.0)
    one, prior = [(pose_of_camera("p0", tele, patch.FRAME), tele)], PriorConfig(KnownDisagreement(), 2, 4, 0.2)
    found = scoring.score_poses(field, patch.grid(), one, patch.photos(), patch.FRAME, prior)
    far = np.linalg.norm(field.means[:, :2] - 0.3, axis=1) > 1
    assert (found.gaussians[far] == np.float32(0.3)).all() and (found.gaussians[~far] != np.float32(0.3)).any()


def test_without_a_prior_only_geometric_terms_are_computed_of_which_coverage_is_the_gain_over_the_photos_so_far():
    found, cells = scored(), coverage.GroundCells(patch.field(), patch.grid())
    assert set(found.scores.terms) == {"opacity", "coverage"} and found.maps.w2_sq is None
    assert np.array_equal(found.gaussians, patch.field().uncertainty)
    assert (found.scores.terms["coverage"] > 0).all() and found.frozen.pixels is None
    masks = [scoring.ground_mask(patch.grid(), scoring.scoring_camera(camera)) for _, camera in pool()]
    means = [(seen * mask).sum() / mask.sum() for seen, mask in zip(found.maps.opacity, masks, strict=True)]
    np.testing.assert_allclose(found.scores.terms["opacity"], means, rtol=1e-6)
    assert all(0 < mask.mean() < 1 for mask in masks)
    taken, wanted = (
        cells.view([scoring.scoring_camera(camera) for camera in seen])
        for seen in ([view.camera for view in patch.photos()], [camera for _, camera in pool()])
    )
    assert np.array_equal(found.maps.cells, wanted.pixels) and wanted.pixels.any(1).all()
    assert np.array_equal(found.scores.terms["coverage"], coverage.DirectionalCoverage(cells, taken, wanted).gains())
    unseen = scoring.score_poses(patch.field(), patch.grid(), pool(), [], patch.FRAME)
    assert (unseen.scores.terms["coverage"] > found.scores.terms["coverage"]).all()


def test_a_prior_is_not_shown_what_no_photo_shows():
    """The south half was guessed: the prior sees a hole there; the geometric terms see the whole field."""
    whole = patch.field()
    south = whole.means[:, 1] < 1.6
    guessed = replace(whole, uncertainty=np.where(south, 1, 0.5).astype(np.float32))
    given = patch.grid(), pool(), patch.photos(), patch.FRAME
    condition, masks = scoring.build_conditions(guessed, *given, 32)
    hole, _ = scoring.build_conditions(whole[np.flatnonzero(~south)], *given, 32)
    assert all(map(np.array_equal, astuple(condition), astuple(hole)))
    above = condition.alpha[0] * (masks[0] > 0)
    assert above[:12].mean() > 0.5 and above[20:].max() < 0.05
    known = scoring.score_poses(guessed, *given).scores.terms["coverage"]
    assert np.array_equal(known, scored().scores.terms["coverage"])
    nothing = replace(whole, uncertainty=np.ones(len(whole), np.float32))
    assert scoring.build_conditions(nothing, *given, 32)[0].alpha.max() == 0


def test_maps_are_read_as_written(tmp_path):
    found = scored(PriorConfig(KnownDisagreement(), 2, 4, 0.2))
    pose_maps.write_pose_maps(tmp_path / "maps.npz", found.maps, found.gaussians)
    back, gaussians = pose_maps.read_pose_maps(tmp_path / "maps.npz")
    (tmp_path / "broken.npz").write_bytes(b"PK nothing of the kind")
    with pytest.raises(InputError, match="broken.npz: not readable as maps"):
        pose_maps.read_pose_maps(tmp_path / "broken.npz")
    assert back.names == ["p0", "p1", "p2"] and np.array_equal(gaussians, found.gaussians)
    assert np.array_equal(back.w2_sq, found.maps.w2_sq)
    np.testing.assert_allclose(back.opacity, found.maps.opacity, atol=1e-3)
    assert scoring.render_above(found, patch.field(), patch.grid()).shape == patch.grid().shape


def test_frozen_scales_are_read_as_written_and_other_files_are_refused(tmp_path):
    first = FrozenScales(Scales({"w2_sq": 1 / 3, "coverage": 0.0}), Quantiles(0.1, 2 / 3))
    scores.write_frozen_scales(tmp_path / "scores.json", first, scored().scores, {}, {})
    assert scores.read_frozen_scales(tmp_path / "scores.json") == first
    for bad in ("{}", '{"scales": [], "pixels": null}', '{"scales": {"w2_sq": -1}, "pixels": null}'):
        (tmp_path / "scores.json").write_text(bad)
        with pytest.raises(InputError, match="scores.json: does not hold the scales"):
            scores.read_frozen_scales(tmp_path / "scores.json")
