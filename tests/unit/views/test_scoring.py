"""Scores of poses over a small ground, by priors whose samples are known."""

from dataclasses import astuple, replace

import numpy as np
import pytest
import torch
from fixtures import ground as patch
from fixtures import lpips_arrays

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import pose_of_camera
from dav_gswt.prior.interface import Condition
from dav_gswt.prior.networks import SIZE, Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.views import scores, scoring
from dav_gswt.views.scores import FrozenScales
from dav_gswt.views.scoring import BATCH, PriorConfig, backproject_maps
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
    scores.write_pose_maps(tmp_path / "maps.npz", found.maps, found.gaussians)
    back, gaussians = scores.read_pose_maps(tmp_path / "maps.npz")
    (tmp_path / "broken.npz").write_bytes(b"PK nothing of the kind")
    with pytest.raises(InputError, match="broken.npz: not readable as maps"):
        scores.read_pose_maps(tmp_path / "broken.npz")
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


N = 8
NAMES = [f"p{i}" for i in range(N)]
ALL = np.ones((N, 32, 32), np.float32)  # every pixel counts


class Grey:
    """Samples that differ in sign."""

    name, size, small = "grey", 32, False

    def sample(self, condition, m, p_drop, steps, seed, common=True):
        signs = np.where(np.arange(m) % 2, -1.0, 1.0)[None, :, None, None, None]
        return (signs * np.ones((len(condition), m, 4, 32, 32))).astype(np.float32)

    def decode(self, latents):
        return np.full((*latents.shape[:2], 32, 32, 4), 0.5, np.float32)


def condition(n):
    blank = np.zeros((n, 32, 32, 3), np.float32)
    return Condition(blank, blank[..., 0], blank[..., 0], blank, np.zeros((n, 4), np.float32))


def sampled(config, n=N, masks=ALL):
    return scoring.sample_terms(config, condition(n), NAMES[:n], masks[:n])


def test_without_dropout_the_one_sample_is_compared_with_the_render():
    alone = PriorConfig(Grey(), 2, 2, 0.0, weights=lpips_arrays.random())
    assert (sampled(alone, 3)["single"] > 0).all()  # grey is not the black that the render shows
    assert not sampled(alone, 3, 0 * ALL)["single"].any()
    assert "single" not in sampled(replace(alone, p_drop=0.1), 3)


def test_terms_do_not_depend_on_the_number_of_threads_which_pytorch_keeps(monkeypatch):
    torch.manual_seed(3)
    prior, rng, count = TerrainPrior(Network()), np.random.default_rng(1), BATCH + 1  # one whole batch and a rest
    planes = [rng.uniform(0, 1, (count, SIZE, SIZE)).astype(np.float32) for _ in range(2)]
    colour, photo = (rng.uniform(0, 1, (count, SIZE, SIZE, 3)).astype(np.float32) for _ in range(2))
    seen = Condition(colour, *planes, photo, rng.uniform(-1, 1, (count, 4)).astype(np.float32))
    config = PriorConfig(prior, 2, 2, 0.2, weights=lpips_arrays.random())
    before, found = torch.get_num_threads(), []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        masks = np.ones((count, SIZE, SIZE), np.float32)
        found.append(scoring.sample_terms(config, seen, NAMES[:count], masks))
        assert torch.get_num_threads() == before
    for name in ("w2_sq", "lpips", "gradient", "maps"):
        np.testing.assert_array_equal(*(each[name] for each in found), err_msg=name)
