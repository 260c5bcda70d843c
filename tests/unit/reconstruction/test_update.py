"""First fields, updates, and rounds whose field is fitted from scratch."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.reconstruction import update
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fitting.plan import FitSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.update import UpdateInput

SETTINGS = FitSettings(fit_size=48, spacing=1.0, max_gaussians=5000, steps=12, steps_per_photo=20)
NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
FRAME = replace(made.FRAME, kind="synthetic")
PRESET = {"fit_size": 48, "spacing": 1.0, "max_gaussians": 5000, "steps": 12, "steps_per_photo": 20}
FILES = update.PhotoFiles("model", "images", 3, False)
GRAIN = 0.03  # as coarse as what a real field does not know of its photos


def start_of(photos, points=NONE[0]):
    return StartViews(FRAME, photos, points, np.full(points.shape, 0.5, np.float32), 0.15)


def fit(photos, settings=SETTINGS):
    return fit_coarse_field(start_of(photos), settings, np.random.default_rng(0))


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    found = fit(photos, replace(SETTINGS, steps=20))
    assert np.isfinite(found.field.means).all() and found.report.steps == 20
    assert evaluate_field(found.field, mask_to_ground(photos[:1], found.grid))["psnr"] == pytest.approx(30, abs=12)


def test_rounds_and_chosen_photos_are_one_fit_to_all_photos_unless_the_preset_says_to_continue(monkeypatch):
    monkeypatch.setattr(update, "read_start_views", lambda frame, views, *_: start_of(views))
    photos = made.photos(5)
    once, first = fit(photos, replace(SETTINGS, steps=12 + 20 * 2, steps_per_photo=0)), fit(photos[:3])
    given = UpdateInput(first.field, first.grid, FRAME, photos[:3], photos[3:])
    again, continued = (
        update.update_as_preset(given, PRESET | {"update": how}, FILES, np.random.default_rng(0))
        for how in ("scratch", "continue")
    )
    chosen = update.fit_chosen_photos(photos, FRAME, PRESET, FILES, np.random.default_rng(0))
    for found in (again, chosen):
        np.testing.assert_array_equal(found.field.means, once.field.means)
        np.testing.assert_array_equal(found.field.sh, once.field.sh)
        np.testing.assert_array_equal(found.grid.heights, once.grid.heights)
        assert found.report.steps == 52
    assert continued.report.steps == 40


def grained(count):
    """Photos with grain, so that no field shows them to the bit."""
    rng = np.random.default_rng(4)
    return [
        replace(v, image=v.image + rng.normal(0, GRAIN, v.image.shape).astype(np.float32)) for v in made.photos(count)
    ]


def updated(earlier, new):
    given = UpdateInput(made.field(), made.grid(), FRAME, earlier, new)
    return update.update_field(given, replace(SETTINGS, steps_per_photo=12), np.random.default_rng(0))


def test_without_new_photos_the_field_stays():
    without = updated(grained(4), [])
    assert without.report.steps == 0
    np.testing.assert_array_equal(without.field.means, made.field().means)


def test_an_update_colours_ground_that_only_the_new_photo_sees():
    seen = made.grid().seen.copy()
    seen[:, 16:] = False
    grid, field, photos = replace(made.grid(), seen=seen), made.field(), made.photos(2)
    sh = field.sh.copy()
    sh[: seen.size][~seen.ravel()] = 0  # mid-grey, as if filled
    given = UpdateInput(replace(field, sh=sh), grid, FRAME, photos[:1], photos[1:])
    after = update.update_field(given, replace(SETTINGS, steps_per_photo=12), np.random.default_rng(0))
    assert after.grid.seen.sum() > seen.sum()
    fresh = np.flatnonzero((after.grid.seen & ~seen).ravel())
    true = made.look(*grid.centres[fresh, :2].T)
    assert np.abs(after.field.base_colours[fresh] - true).mean() < 0.05
