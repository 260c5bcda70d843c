"""An update shows what new photos show, loses at most the bound on the earlier ones, and reports what it did."""

import json
import logging
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import rgb_to_sh
from dav_gswt.reconstruction import regression_guard
from dav_gswt.reconstruction.fitting.plan import FitReport, FitSettings
from dav_gswt.reconstruction.fitting.trainer import FitResult
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.update import UpdateInput, update_field

QUALITY = FitSettings(size=48, spacing=1.0, steps=12, max_gaussians=2000, steps_per_photo=12)
GRAIN = 0.03  # as coarse as what a real field does not know of its photos
SYNTHETIC = replace(made.FRAME, kind="synthetic")


def grained(count):
    """Photos with grain, so that no field shows them to the bit."""
    rng = np.random.default_rng(4)
    return [
        replace(v, image=v.image + rng.normal(0, GRAIN, v.image.shape).astype(np.float32)) for v in made.photos(count)
    ]


def refined(before, new, frame=SYNTHETIC):
    given = UpdateInput(made.field(), made.grid(), frame, before, new)
    return update_field(given, QUALITY, np.random.default_rng(0))


def same(a, b):
    for name, values in vars(a).items():
        np.testing.assert_array_equal(values, getattr(b, name))


def test_ordinary_photos_are_taken_and_both_sides_are_reported():
    photos = grained(4)
    found = refined(photos[:1], photos[1:])
    report, masked = found.report, mask_to_ground(photos[:1], made.grid())
    assert report.taken and (report.earlier_photos, report.steps) == (1, 36)
    assert report.new_photos == ["photo_1", "photo_2", "photo_3"]
    before, after = (np.mean(regression_guard.measure_psnr(f, masked)) for f in (made.field(), found.field))
    assert (report.psnr_before, report.psnr_after) == pytest.approx((before, after), abs=1e-9)
    json.dumps(vars(found.report), allow_nan=False)


def test_photos_that_contradict_the_others_change_nothing(caplog, monkeypatch):
    monkeypatch.setattr(regression_guard, "VISIBLE_PSNR", 50.0)  # the made-up ground is shown at 42 dB
    photos = grained(4)
    upside_down = [replace(view, image=np.ascontiguousarray(view.image[::-1, ::-1])) for view in photos[1:]]
    found = refined(photos[:1], upside_down, made.FRAME)
    assert not found.report.taken and found.report.psnr_after == found.report.psnr_before
    assert found.report.steps == 3 * 36 and found.report.gaussians == len(made.field())
    assert "the new photos contradict the earlier ones: with photo_1, photo_2, photo_3" in caplog.text
    same(found.field, made.field())
    assert np.array_equal(found.grid.heights, made.grid().heights)
    without = refined(photos, [])
    same(without.field, made.field())
    assert without.report.taken and without.report.new_photos == [] and without.report.steps == 0
    reports = [vars(found.report), vars(without.report)]
    assert regression_guard.list_rejected_photos(reports) == {"photo_1", "photo_2", "photo_3"}


def test_an_update_colours_ground_that_only_the_new_photo_sees():
    seen = made.grid().seen.copy()
    seen[:, 16:] = False
    grid, field, photos = replace(made.grid(), seen=seen), made.field(), made.photos(2)
    sh = field.sh.copy()
    sh[: seen.size][~seen.ravel()] = 0  # mid-grey, as if filled
    given = UpdateInput(replace(field, sh=sh), grid, SYNTHETIC, photos[:1], photos[1:])
    after = update_field(given, replace(QUALITY, max_gaussians=5000), np.random.default_rng(0))
    assert after.grid.seen.sum() > seen.sum()
    fresh = np.flatnonzero((after.grid.seen & ~seen).ravel())
    true = made.look(*grid.centres[fresh, :2].T)
    assert np.abs(after.field.base_colours[fresh] - true).mean() < 0.05


def spoilt(amount):
    """The made-up field with a noise in its colours."""
    field = made.field()
    noise = np.random.default_rng(1).normal(0, amount, (len(field), 3))
    return replace(field, sh=rgb_to_sh(field.base_colours + noise))


@pytest.mark.parametrize("reached, fits, taken", [([0.3, 0.0], 2, True), ([0.3, 0.3, 0.3], 3, False)])
def test_a_fit_goes_on_for_as_many_steps_twice_at_most(reached, fits, taken, caplog):
    photos, asked = grained(3), []

    def fit(start, plan):
        asked.append((start, plan.steps))
        return FitResult(spoilt(reached[len(asked) - 1]), FitReport(7, 1))

    plan = QUALITY.plan_update(2, 1)
    with caplog.at_level(logging.INFO):
        field, report = regression_guard.fit_with_guard(made.field(), spoilt(0.01), photos[:2], photos[2:], plan, fit)
    assert [steps for _, steps in asked] == [plan.steps, 7, 7][:fits] and report.taken == taken
    assert report.steps == 7 * fits
    assert caplog.text.count("fitting on") == fits - 1
    same(field, spoilt(reached[fits - 1]) if taken else made.field())


def test_exposure_and_pixels_that_do_not_count_are_no_harm_and_the_sky_is_part_of_the_picture():
    view = grained(1)[0]
    weight = view.weight.copy()
    weight[:, 24:] = 0
    dim = replace(view, image=0.7 * view.image + 0.1, weight=weight)
    plain, found = regression_guard.measure_psnr(made.field(), [replace(view, weight=weight), dim])
    assert found == pytest.approx(plain - 20 * np.log10(0.7), abs=0.1)  # the grain is dimmed with the photo
    dim.image[:, 24:] = 1
    others = [dim, replace(view, weight=0 * weight), *made.photos(1)]
    spoilt_half, blind, right = regression_guard.measure_psnr(made.field(), others)
    assert spoilt_half == found and blind is None
    assert right > 60  # but for the rounding of the exposure
    view, empty = made.photos(1)[0], made.field()[:0]
    behind = np.random.default_rng(0).random(view.image.shape).astype(np.float32)
    views = [replace(view, image=behind, behind=behind), replace(view, image=behind)]
    with_sky, without = regression_guard.measure_psnr(empty, views)
    assert with_sky == regression_guard.EQUAL_PSNR and without < 20


def test_losses_count_where_they_can_be_seen_and_more_may_be_lost_with_every_doubling_of_the_photos():
    assert regression_guard.mean_loss([30.0, 32.0], [29.0, 28.0]) == 2.5
    assert regression_guard.mean_loss([46.0, 44.0], [40.5, 41.0]) == 0  # noise that was fitted is given up
    assert regression_guard.mean_loss([44.0, 30.0], [38.0, 30.0]) == 1  # each photo by itself, below VISIBLE_PSNR
    assert regression_guard.mean_loss([None, 30.0], [None, 28.0]) == 2
    assert regression_guard.mean_loss([None], [None]) == 0
    found = [regression_guard.allowed_loss(*of) for of in ((8, 0), (8, 8), (8, 24), (0, 5))]
    assert found == [1.5, 2.0, 2.5, 1.5]
