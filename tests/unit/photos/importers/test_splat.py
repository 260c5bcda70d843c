"""Finished fields: found upright, scaled, cleaned."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from scipy.spatial.transform import Rotation

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, write_field
from dav_gswt.photos.importers import splat
from dav_gswt.photos.importers.splat import fit_field_frame
from dav_gswt.photos.photo_set import import_field


def ground_field(rng, n=6000, degree=0):
    """A ground of discs over a square of side 2 with z up, bushes on a tenth of it, and a few floaters."""
    means = synth.plain(n, 1.0, rng, relief=0.004)
    means[: n // 10, 2] += rng.uniform(0, 0.2, n // 10)
    means[-20:] = rng.normal(0, 40, (20, 3))
    scales = np.tile(np.log([0.02, 0.02, 0.002]), (n, 1))
    return GaussianField(
        means.astype(np.float32),
        scales.astype(np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (n, 1)),
        np.full(n, 4, np.float32),
        rng.normal(0, 0.3, (n, (degree + 1) ** 2, 3)).astype(np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


def covariances(field):
    turn = Rotation.from_quat(field.quats[:, [1, 2, 3, 0]]).as_matrix()
    return np.einsum("nij,nj,nkj->nik", turn, np.exp(2.0 * field.log_scales.astype(float)), turn)


@pytest.fixture
def rng():
    return np.random.default_rng(2)


def test_a_field_enters_its_ground_frame_upright_scaled_and_cleaned(rng):
    """A ground lying as COLMAP leaves it (y down), ten times as large, off the origin."""
    upright = ground_field(rng, degree=1)
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    lying = splat._transform_field(upright, turn, 10.0, np.array([3.0, 50, -7]))
    field, facts = fit_field_frame(lying, rng)
    z, side = field.means[:, 2], facts.exemplar.side
    assert np.median(z) == pytest.approx(0, abs=0.002)  # 6000 heights of 0.004 / side
    assert z.max() > 0.05 * side and z.min() > -0.02 * side  # bushes stand up
    assert facts.relief < 0.01
    # The square is 2 wide; percentiles and the inset take 2 % each on both sides.
    scale = 2 / np.ptp(np.percentile(field.means[:, 0], [0.5, 99.5]))
    assert side * scale == pytest.approx(2 * 0.94, rel=0.03)
    assert (facts.exemplar.west, facts.exemplar.south) == pytest.approx((-side / 2, -side / 2))
    for low, high in ((facts.extent.west, facts.extent.east), (facts.extent.south, facts.extent.north)):
        assert low <= -side / 2 and high >= side / 2 and scale * (high - low) == pytest.approx(2 * 0.98, rel=0.03)
    # From the flying height a picture shows just the exemplar.
    assert 2 * np.tan(np.radians(splat.VIEW / 2)) * facts.flying_height == pytest.approx(side)
    assert len(lying) - len(field) == facts.removed and facts.gaussians == len(field)
    assert 15 <= facts.removed <= 20  # a floater may lie within the scene by chance
    assert np.abs(field.means).max() < 2
    assert field.sh.shape[1:] == (1, 3)  # the colour that is the same from all sides


def test_a_large_haze_is_no_part_of_the_scene(rng):
    field = ground_field(rng)
    field.log_scales[:7] = np.log(5.0)
    assert fit_field_frame(field, rng, (0, 0, 1))[1].removed in range(22, 28)


def test_covariances_turn_and_grow_with_the_field(rng):
    field = ground_field(rng, n=50)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = splat._transform_field(field, turn, 3.0, np.ones(3))
    # Through float32 quaternions and logarithms.
    assert covariances(moved) == pytest.approx(9 * turn @ covariances(field) @ turn.T, rel=1e-4, abs=1e-8)
    assert moved.means == pytest.approx(3 * field.means @ turn.T + 1, rel=1e-5, abs=1e-5)


def test_up_says_which_side_is_up(rng):
    field = ground_field(rng)
    above, _ = fit_field_frame(field, np.random.default_rng(0), (0, 0, 1))
    below, _ = fit_field_frame(field, np.random.default_rng(0), (0, 0, -1))
    assert above.means[:, 2].max() > 0.05 and below.means[:, 2].min() < -0.05


@pytest.mark.parametrize(
    "up, said", [((0, -1, 0), "direction `up`"), ((0, 0, 0), "level plane"), ((0, float("nan"), 1), "level plane")]
)
def test_up_that_no_ground_lies_across_is_refused(rng, up, said):
    with pytest.raises(InputError, match=said):
        fit_field_frame(ground_field(rng, n=1000), rng, up)


def test_a_field_without_a_surface_is_refused_by_file_name(rng, tmp_path):
    field = ground_field(rng, n=200)
    write_field(replace(field, opacity_logits=field.opacity_logits - 8), tmp_path / "haze.ply")
    with pytest.raises(InputError, match="haze.ply.*opaque"):
        import_field(tmp_path / "haze.ply", tmp_path / "out.ply", tmp_path / "ground.json")
    assert not (tmp_path / "out.ply").exists() and not (tmp_path / "ground.json").exists()
