"""Finished fields: found upright, scaled, cleaned."""

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


@pytest.fixture
def entered(rng):
    """A ground lying as COLMAP leaves it (y down), ten times as large, off the origin; and what came of it."""
    upright = ground_field(rng, degree=1)
    lying = splat._transform_field(
        upright, np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), 10.0, np.array([3.0, 50, -7])
    )
    return lying, *fit_field_frame(lying, rng)


def test_the_ground_lies_at_0_and_bushes_stand_up(entered):
    _, field, facts = entered
    z = field.means[:, 2] * 1.0
    side = facts.exemplar.side
    assert np.median(z) == pytest.approx(0, abs=0.002)  # 6000 heights of 0.004 / side
    assert z.max() > 0.05 * side and z.min() > -0.02 * side
    assert facts.relief < 0.01


def test_the_exemplar_is_nearly_the_whole_ground(entered):
    _, field, facts = entered
    # The square is 2 wide; percentiles and the inset take 2 % each on both sides.
    scale = 2 / np.ptp(np.percentile(field.means[:, 0], [0.5, 99.5]))
    assert facts.exemplar.side * scale == pytest.approx(2 * 0.94, rel=0.03)
    extent, square = facts.extent, facts.exemplar
    assert extent.west <= square.west and extent.north >= square.south + square.side


def test_from_the_flying_height_a_picture_shows_just_the_exemplar(entered):
    side = entered[2].exemplar.side
    assert 2 * np.tan(np.radians(splat.VIEW / 2)) * entered[2].flying_height == pytest.approx(side)


def test_far_floaters_are_removed_and_counted(entered):
    lying, field, facts = entered
    assert len(lying) - len(field) == facts.removed
    assert 15 <= facts.removed <= 20  # a floater may lie within the scene by chance
    assert np.abs(field.means).max() < 2


def test_colour_keeps_only_the_part_that_is_the_same_from_all_sides(entered):
    _, field, _ = entered
    assert field.sh.shape[1:] == (1, 3)


def test_covariances_turn_and_grow_with_the_field(rng):
    field = ground_field(rng, n=50)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = splat._transform_field(field, turn, 3.0, np.ones(3))
    # Through float32 quaternions and logarithms.
    assert covariances(moved) == pytest.approx(9 * turn @ covariances(field) @ turn.T, rel=1e-4, abs=1e-8)
    assert moved.means == pytest.approx(3 * field.means @ turn.T + 1, rel=1e-5, abs=1e-5)


def test_quaternions_of_any_length_mean_the_same(rng):
    field = ground_field(rng, n=400)
    long = GaussianField(
        field.means, field.log_scales, field.quats * np.float32(1e30), *(field[:].__dict__[k] for k in REST)
    )
    one, two = (fit_field_frame(f, np.random.default_rng(0), (0, 0, 1))[0] for f in (field, long))
    assert np.array_equal(one.quats, two.quats)


REST = ("opacity_logits", "sh", "uncertainty", "ground")


def test_up_says_which_side_is_up(rng):
    field = ground_field(rng)
    above, _ = fit_field_frame(field, np.random.default_rng(0), (0, 0, 1))
    below, _ = fit_field_frame(field, np.random.default_rng(0), (0, 0, -1))
    assert above.means[:, 2].max() > 0.05 and below.means[:, 2].min() < -0.05


def test_up_along_the_ground_is_refused_and_says_what_to_give(rng):
    with pytest.raises(InputError, match="up"):
        fit_field_frame(ground_field(rng), rng, (0, -1, 0))


@pytest.mark.parametrize("up", [(0, 0, 0), (0, float("nan"), 1)])
def test_up_that_is_no_direction_is_refused(rng, up):
    with pytest.raises(InputError, match="no direction"):
        fit_field_frame(ground_field(rng), rng, up)


def test_a_field_without_a_surface_is_refused_by_file_name(rng, tmp_path):
    haze = ground_field(rng, n=200)
    haze = GaussianField(
        *(getattr(haze, k) for k in ("means", "log_scales", "quats")),
        haze.opacity_logits - 8,
        *(getattr(haze, k) for k in ("sh", "uncertainty", "ground")),
    )
    write_field(haze, tmp_path / "haze.ply")
    with pytest.raises(InputError, match="haze.ply.*opaque"):
        import_field(tmp_path / "haze.ply", tmp_path / "out.ply", tmp_path / "ground.json")
    assert not (tmp_path / "out.ply").exists() and not (tmp_path / "ground.json").exists()


def test_the_same_file_gives_the_same_bytes(rng, tmp_path):
    write_field(ground_field(rng), tmp_path / "in.ply")
    for name in ("a", "b"):
        import_field(tmp_path / "in.ply", tmp_path / f"{name}.ply", tmp_path / f"{name}.json", (0, 0, 1))
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
