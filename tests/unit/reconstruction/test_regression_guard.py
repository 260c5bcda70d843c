"""An update loses at most the bound on the earlier photos, and reports what it did."""

import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import read_field, rgb_to_sh, write_field
from dav_gswt.reconstruction import ground, regression_guard
from dav_gswt.reconstruction.fit_settings import UPDATE_RATE, UpdateSettings
from dav_gswt.reconstruction.fitting.plan import AUTO, STEPS_PER_NEW_PHOTO, FitReport
from dav_gswt.reconstruction.fitting.trainer import FitResult
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.refinement import RefinementInput, refine_field

QUALITY = UpdateSettings(size=48, max_gaussians=2000, steps_per_photo=12)
GRAIN = 0.03  # as coarse as what a real field does not know of its photos
SYNTHETIC = replace(made.FRAME, kind="synthetic")


def grained(count):
    """Photos with grain, so that no field shows them to the bit."""
    rng = np.random.default_rng(4)
    return [
        replace(v, image=v.image + rng.normal(0, GRAIN, v.image.shape).astype(np.float32)) for v in made.photos(count)
    ]


def upside_down(view):
    return replace(view, image=np.ascontiguousarray(view.image[::-1, ::-1]))


def refined(before, new, quality=QUALITY, seed=0, frame=SYNTHETIC):
    given = RefinementInput(made.field(), made.grid(), frame, before, new)
    return refine_field(given, quality, np.random.default_rng(seed))


def same(a, b):
    for name, values in vars(a).items():
        np.testing.assert_array_equal(values, getattr(b, name))


def another_place(view):
    other = 1 - view.image.swapaxes(0, 1)
    return replace(view, image=np.ascontiguousarray(np.clip(0.5 + 3 * (other - other.mean()), 0, 1)))


@pytest.mark.parametrize("frame", [made.FRAME, SYNTHETIC], ids=["photos", "synthetic"])
def test_ordinary_photos_are_taken_and_both_sides_are_reported(frame):
    photos = grained(4)
    found = refined(photos[:1], photos[1:], frame=frame)
    earlier, new = found.report.earlier_views, found.report.new_views
    assert new.taken and earlier.handed_on == "the field of fit 1" and found.report.steps == 36
    assert (earlier.photos, earlier.bound, new.photos) == (1, regression_guard.allowed_loss(1, 3), 3)
    assert [row["view"] for row in new.views] == ["photo_1", "photo_2", "photo_3"]
    if frame is SYNTHETIC:  # real photos are first brought to one exposure
        masked = mask_to_ground(photos, made.grid())
        for side, views in ((earlier, masked[:1]), (new, masked[1:])):
            assert side.psnr_before == pytest.approx(
                np.mean(regression_guard.measure_psnr(made.field(), views)), abs=1e-9
            )
            assert side.psnr_after == pytest.approx(
                np.mean(regression_guard.measure_psnr(found.field, views)), abs=1e-9
            )
    json.dumps(found.report.to_dict(), allow_nan=False)


@pytest.mark.parametrize("wrong", [upside_down, another_place])
@pytest.mark.parametrize("frame", [made.FRAME, SYNTHETIC], ids=["photos", "synthetic"])
def test_photos_that_contradict_the_others_change_nothing(wrong, frame, caplog, monkeypatch):
    monkeypatch.setattr(regression_guard, "VISIBLE_PSNR", 50.0)  # the made-up ground is shown at 42 dB
    photos = grained(4)
    found = refined(photos[:1], [wrong(view) for view in photos[1:]], frame=frame)
    earlier, new = found.report.earlier_views, found.report.new_views
    assert max(earlier.psnr_of_fits) < earlier.psnr_before - earlier.bound
    assert not new.taken and earlier.psnr_after == earlier.psnr_before
    assert earlier.handed_on == "the field from before, after 3 fits" and len(earlier.psnr_of_fits) == 3
    assert found.report.steps == 3 * 36 and found.report.gaussians == len(made.field())
    assert "the new photos contradict the earlier ones: with photo_1, photo_2, photo_3" in caplog.text
    same(found.field, made.field())
    assert np.array_equal(found.grid.heights, made.grid().heights)
    assert regression_guard.list_rejected_photos(
        [found.report.to_dict(), regression_guard.report_unchanged(found.field).to_dict()]
    ) == {
        "photo_1",
        "photo_2",
        "photo_3",
    }


def test_one_wrong_photo_among_good_ones_costs_no_more_than_the_bound():
    photos = grained(4)
    found = refined(photos[:1], [upside_down(photos[1]), *photos[2:]]).report.earlier_views
    assert found.psnr_after >= found.psnr_before - found.bound


def test_the_same_seed_gives_the_same_field_and_report(monkeypatch):
    photos, found = grained(4), []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append([refined(photos[:1], new, seed=3) for new in (photos[1:], [upside_down(v) for v in photos[1:]])])
    for one, two in zip(*found, strict=True):
        same(one.field, two.field)
        assert one.report == two.report


def test_without_new_photos_field_and_ground_go_on_to_the_byte(tmp_path):
    write_field(refined(grained(3)[:2], grained(3)[2:]).field, tmp_path / "a.ply")
    ground.write_ground(made.grid(), tmp_path / "a.exr")
    last = read_field(tmp_path / "a.ply"), ground.read_ground(tmp_path / "a.exr")
    found = refine_field(RefinementInput(*last, SYNTHETIC, grained(2), []), QUALITY, np.random.default_rng(0))
    write_field(found.field, tmp_path / "b.ply")
    ground.write_ground(found.grid, tmp_path / "b.exr")
    for kind in ("ply", "exr"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
    assert found.report.new_views.photos == found.report.steps == 0
    assert found.report.earlier_views is None and not regression_guard.list_rejected_photos([found.report.to_dict()])


def spoilt(amount):
    """The made-up field with a noise in its colours."""
    field = made.field()
    noise = np.random.default_rng(1).normal(0, amount, (len(field), 3))
    return replace(field, sh=rgb_to_sh(field.base_colours + noise))


@pytest.mark.parametrize(
    "reached, fits, taken",
    [
        pytest.param([0.0], 1, True, id="good at once"),
        pytest.param([0.3, 0.0], 2, True, id="good after fitting on"),
        pytest.param([0.3, 0.2, 0.0], 3, True, id="good at last"),
        pytest.param([0.3, 0.3, 0.3], 3, False, id="never good"),
    ],
)
def test_a_fit_goes_on_for_as_many_steps_twice_at_most(reached, fits, taken, caplog):
    photos, asked = grained(3), []

    def fit(start, plan):
        asked.append((start, plan.steps))
        return FitResult(spoilt(reached[len(asked) - 1]), FitReport(7, 1, 0, [{"what": len(asked)}]))

    plan = QUALITY.plan_update(made.field(), 2, 1)
    with caplog.at_level(logging.INFO):
        found = regression_guard.fit_with_guard(made.field(), spoilt(0.01), photos[:2], photos[2:], plan, fit)
    assert [steps for _, steps in asked] == [plan.steps, 7, 7][:fits] and found.accepted == taken
    assert found.report.steps == 7 * fits and [c["what"] for c in found.report.choices] == [1, 2, 3][:fits]
    assert caplog.text.count("fitting on") == fits - 1
    assert found.report.new_views.psnr_before == pytest.approx(
        np.mean(regression_guard.measure_psnr(made.field(), photos[2:]))
    )
    same(found.field, spoilt(reached[fits - 1]) if taken else made.field())


def test_exposure_and_pixels_that_do_not_count_are_no_harm():
    view = grained(1)[0]
    weight = view.weight.copy()
    weight[:, 24:] = 0
    dim = replace(view, image=0.7 * view.image + 0.1, weight=weight)
    (plain,) = regression_guard.measure_psnr(made.field(), [replace(view, weight=weight)])
    (found,) = regression_guard.measure_psnr(made.field(), [dim])
    assert found == pytest.approx(plain - 20 * np.log10(0.7), abs=0.1)  # the grain is dimmed with the photo
    spoilt_half = dim.image.copy()
    spoilt_half[:, 24:] = 1
    assert regression_guard.measure_psnr(made.field(), [replace(dim, image=spoilt_half)]) == [found]
    blind, right = replace(view, weight=np.zeros_like(weight)), made.photos(1)[0]
    assert regression_guard.measure_psnr(made.field(), [blind]) == [None]
    assert regression_guard.measure_psnr(made.field(), [right])[0] > 60  # but for the rounding of the exposure


def test_the_sky_behind_the_field_is_part_of_its_picture():
    view = made.photos(1)[0]
    empty = made.field()[:0]
    behind = np.random.default_rng(0).random(view.image.shape).astype(np.float32)
    shown = regression_guard.measure_psnr(empty, [replace(view, image=behind, behind=behind)])
    assert (
        shown == [regression_guard.EQUAL_PSNR]
        and regression_guard.measure_psnr(empty, [replace(view, image=behind)])[0] < 20
    )


@pytest.mark.parametrize(
    "before, after, lost",
    [
        pytest.param([30.0, 32.0], [29.0, 28.0], 2.5, id="the mean"),
        pytest.param([46.0, 44.0], [40.5, 41.0], 0.0, id="noise that was fitted is given up"),
        pytest.param([44.0, 30.0], [38.0, 30.0], 1.0, id="each photo by itself, what is below VISIBLE_PSNR"),
        pytest.param([None, 30.0], [None, 28.0], 2.0, id="one that does not count"),
        pytest.param([None], [None], 0.0, id="none that counts"),
        pytest.param([30.0], [33.0], -3.0, id="a gain"),
    ],
)
def test_losses_count_where_they_can_be_seen(before, after, lost):
    assert regression_guard.mean_loss(before, after) == lost


def test_where_no_earlier_photo_counts_there_is_nothing_to_lose():
    photos = grained(3)
    blind = [replace(v, weight=np.zeros_like(v.weight)) for v in photos[:2]]
    found = regression_guard.fit_with_guard(
        made.field(),
        made.field(),
        blind,
        photos[2:],
        QUALITY.plan_update(made.field(), 2, 1),
        lambda *_: FitResult(spoilt(0.3), FitReport()),
    )
    assert found.accepted and found.report.earlier_views.psnr_before is None


def test_what_may_be_lost_grows_with_every_doubling_of_the_photos():
    more = [
        regression_guard.allowed_loss(*of) - regression_guard.ALLOWED_LOSS for of in ((8, 0), (8, 8), (8, 24), (0, 5))
    ]
    assert more == [0, regression_guard.LOSS_PER_DOUBLING, 2 * regression_guard.LOSS_PER_DOUBLING, 0]


def test_an_update_takes_so_many_steps_for_each_new_photo_and_keeps_the_degree_that_was_found():
    flat, rich = made.field(), replace(made.field(), sh=np.repeat(made.field().sh, 4, 1))
    assert QUALITY.plan_update(flat, 2, 3).steps == 36
    assert QUALITY.plan_update(flat, 2, 3).first_rate == UPDATE_RATE < QUALITY.plan_update(flat, 0, 3).first_rate
    found = replace(QUALITY, steps_per_photo=AUTO, sh_degree=AUTO).plan_update(rich, 2, 3)
    assert found.steps == 3 * STEPS_PER_NEW_PHOTO and found.sh_degree == 1
    assert QUALITY.plan_update(rich, 2, 3).sh_degree == QUALITY.sh_degree


def test_an_update_without_a_number_has_as_many_gaussians_a_photo_as_the_field_before():
    plan = replace(QUALITY, max_gaussians=AUTO).plan_update(made.field(), 8, 4)
    assert (plan.max_gaussians, plan.limit) == (AUTO, int(1.5 * len(made.field())))
    assert replace(QUALITY, max_gaussians=AUTO).plan_update(made.field(), 0, 2).limit == 2 * len(made.field())
