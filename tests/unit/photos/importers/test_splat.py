"""Finished fields and splats of other programs: read as described, found upright, scaled, cleaned."""

import gzip
import re
from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.random_field import random_field
from fixtures.splat_files import read_spz
from scipy.spatial.transform import Rotation

from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.export.splat_files import write_spz
from dav_gswt.export.spool import Spool
from dav_gswt.field import GaussianField, write_field
from dav_gswt.photos.importers import splat
from dav_gswt.photos.importers.splat import fit_field_frame
from dav_gswt.photos.importers.splat_files import read_splat
from dav_gswt.photos.photo_set import import_field


def ground_field(rng, n=6000):
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
        rng.normal(0, 0.3, (n, 1, 3)).astype(np.float32),
        np.zeros(n, np.float32),
        np.zeros(n, bool),
    )


@pytest.fixture
def rng():
    return np.random.default_rng(2)


def test_a_field_enters_its_ground_frame_upright_scaled_and_cleaned(rng):
    """A ground lying as COLMAP leaves it (y down), ten times as large, off the origin."""
    upright = ground_field(rng)
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


TURNS = {"z up": np.eye(3), "y down": [[1, 0, 0], [0, 0, -1], [0, 1, 0]], "y up": [[1, 0, 0], [0, 0, 1], [0, -1, 0]]}


@pytest.mark.parametrize("axes", TURNS)
def test_up_is_the_side_on_which_things_stand(rng, caplog, axes):
    turn = np.array(TURNS[axes], float)
    lying = splat._transform_field(ground_field(rng), turn, 1.0, np.zeros(3))
    field, frame = fit_field_frame(lying, rng)
    assert field.means[:, 2].max() > 0.05 > 0.02 > -field.means[:, 2].min()
    assert frame.source is not None and frame.source.axes[2] == pytest.approx(turn[:, 2], abs=0.01)
    assert "upside down" not in caplog.text


def test_ground_on_which_nothing_stands_is_turned_as_usual_and_the_key_is_named(rng, caplog):
    flat = ground_field(rng)[1000:5900]
    lying = splat._transform_field(flat, np.array(TURNS["y up"], float), 1.0, np.zeros(3))
    _, frame = fit_field_frame(lying, rng)
    assert frame.source is not None and frame.source.axes[2] == pytest.approx([0, -1, 0], abs=0.01)
    assert "upside down, give `up: [0.0, 1.0, 0.0]`" in caplog.text
    _, frame = fit_field_frame(lying, rng, usual=splat.UP_OF_SPZ)
    assert frame.source is not None and frame.source.axes[2] == pytest.approx([0, 1, 0], abs=0.01)


def sky(rng, count, radius):
    """A hemisphere of opaque Gaussians above ground that has z up."""
    rays = rng.normal(size=(count, 3))
    rays[:, 2] = np.abs(rays[:, 2])
    rays *= radius / np.linalg.norm(rays, axis=1, keepdims=True)
    size = np.log(radius * np.sqrt(2 * np.pi / count))
    whole = ground_field(rng, n=count)
    return replace(whole, means=rays.astype(np.float32), log_scales=np.full((count, 3), size, np.float32))


@pytest.mark.parametrize("share, radius", [(0.01, 5), (0.01, 100), (0.15, 5), (0.15, 25), (0.4, 25)])
def test_a_shell_of_sky_is_dropped_and_said(rng, caplog, share, radius):
    field = ground_field(rng)[:-20]
    alone = fit_field_frame(field, np.random.default_rng(0))[1]
    around = sky(rng, int(share / (1 - share) * len(field)), radius)
    _, frame = fit_field_frame(GaussianField.concatenate([field, around]), np.random.default_rng(0))
    assert frame.removed == len(around) and alone.removed == 0
    assert frame.source is not None and alone.source is not None
    side, wanted = (f.exemplar.side * f.source.unit for f in (frame, alone))
    assert side == pytest.approx(wanted, rel=0.02)
    assert f"{len(around)} of {len(field) + len(around)} Gaussians" in caplog.text and "crop" in caplog.text


def test_a_crop_is_the_scene_whatever_lies_around(rng):
    field = ground_field(rng, n=24000)[:-20]
    cropped, frame = fit_field_frame(field, rng, (0, 0, 1), crop=((-1, -1, -1), (0, 0, 1)))
    assert frame.source is not None
    inside = (field.means[:, :2] <= 0).all(1)
    assert len(cropped) == inside.sum()
    assert frame.exemplar.side * frame.source.unit == pytest.approx(0.94, rel=0.04)
    with pytest.raises(InputError, match="0 opaque Gaussians in the box `crop`"):
        fit_field_frame(field, rng, crop=((5, 5, 5), (6, 6, 6)))


def test_the_frame_says_where_the_world_lies_in_the_file(rng):
    """Places of UTM size come back to the precision of float32 within the scene."""
    turn = Rotation.from_euler("xyz", [100, 5, 30], degrees=True).as_matrix()
    lying = splat._transform_field(ground_field(rng)[:-20], turn, 3.0, np.array([2.0, 1, 0]))
    origin = np.array([456789.0, 5234567.0, 420.0])
    field, frame = fit_field_frame(lying, rng, origin=origin)
    assert frame.source is not None
    back = np.array(frame.source.origin) + frame.source.unit * field.means.astype(float) @ np.array(frame.source.axes)
    assert back == pytest.approx(lying.means + origin, abs=1e-5)
    crop = (origin - 9, origin + 9)
    assert len(fit_field_frame(lying, rng, crop=crop, origin=origin)[0]) == len(lying)


def test_positions_coarser_than_the_gaussians_are_refused(rng):
    field = ground_field(rng)
    far = replace(field, means=field.means + np.float32([0, 5234567, 0]))
    with pytest.raises(InputError, match="0.5 apart.*double"):
        fit_field_frame(far, rng)


@pytest.fixture
def field():
    given = random_field(300, seed=3)
    return replace(given, log_scales=given.log_scales - 3, sh=0.5 * given.sh)


@pytest.fixture(params=[2, 3])
def spz(request, field, tmp_path):
    with Spool(tmp_path / "spool") as spool:
        spool.append(field)
    write_spz(spool, tmp_path / "a.spz", request.param)
    return tmp_path / "a.spz"


def test_an_spz_is_read_as_a_second_reader_does(spz, field):
    splats, other = read_splat(spz), read_spz(spz)
    read = splats.field
    np.testing.assert_allclose(read.means, other.means, atol=1e-6)
    np.testing.assert_allclose(read.means, turn_field(field, Y_UP).means, atol=1e-3)
    np.testing.assert_allclose(read.log_scales, other.log_scales, atol=1e-6)
    np.testing.assert_allclose(read.sh, other.sh, atol=1e-5)
    np.testing.assert_allclose(np.abs((read.quats * other.quats).sum(1)), 1, atol=1e-2)  # 3 bytes a rotation
    seen = np.abs(read.opacity_logits) < 16
    np.testing.assert_allclose(read.opacity_logits[seen], other.opacity_logits[seen], atol=1e-4)
    assert splats.sh_degree == 0 and not splats.origin.any()


def test_an_spz_of_version_1_has_half_precision_places(tmp_path):
    places = np.array([[1.5, -2, 0.25], [7, 0, -8]], "<f2")
    header = np.array([0x5053474E, 1, 2], "<u4").tobytes() + bytes([1, 0, 0, 0])
    columns = places.tobytes() + bytes([255, 0]) + bytes(6) + bytes([160] * 6) + bytes([128] * 6) + bytes(18)
    (tmp_path / "a.spz").write_bytes(gzip.compress(header + columns))
    splats = read_splat(tmp_path / "a.spz")
    assert splats.field.means.tolist() == places.tolist() and splats.sh_degree == 1
    assert splats.field.opacity_logits.tolist() == [16, -16] and not splats.field.log_scales.any()


def test_what_is_cut_short_or_announces_too_much_is_refused(spz, tmp_path):
    whole = gzip.decompress(spz.read_bytes())
    more = whole[:8] + np.uint32(99_000_000).tobytes() + whole[12:]
    files = {"a.spz": spz.read_bytes()[:-40], "b.spz": gzip.compress(whole[:-9]), "c.spz": gzip.compress(more)}
    files |= {"d.spz": gzip.compress(b"other" * 9)}
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match=re.escape(name)):
            read_splat(tmp_path / name)
    with pytest.raises(InputError, match="g.spz: there is no such file"):
        read_splat(tmp_path / "g.spz")


@pytest.mark.parametrize(
    "name, data, kind",
    [
        ("a b.ksplat", bytes(99), "a .ksplat"),
        ("b.splat", bytes(64), "a .splat"),
        ("a.spz", b"NGSP" + bytes(40), "an SPZ of version 4"),
    ],
)
def test_kinds_that_are_not_read_are_named_with_the_command_that_converts_them(tmp_path, name, data, kind):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(
        InputError, match=f"is {re.escape(kind)}.*convert it: npx @playcanvas/splat-transform .*{name}'? .*ply"
    ):
        read_splat(tmp_path / name)
