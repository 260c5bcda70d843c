"""Rounds whose field is fitted from scratch."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.reconstruction import ground, refit
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.reconstruction.refinement import RefinementInput

COARSE = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=60)
SETTINGS = refit.ScratchSettings(COARSE, UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=20), start=3)
NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
MATCHED = refit.MatchedPoints(*NONE, 0.15)
FRAME = replace(made.FRAME, kind="synthetic")


def fit(photos, settings=COARSE):
    return fit_coarse_field(StartViews(FRAME, photos, *NONE, 0.15), settings, np.random.default_rng(0))


def refit_with(new, earlier=None):
    earlier = earlier or made.photos(5)[:3]
    first = fit(earlier)
    given = RefinementInput(first.field, first.grid, FRAME, earlier, new)
    return first, refit.refit_from_scratch(given, MATCHED, SETTINGS, np.random.default_rng(0))


def test_it_is_one_fit_to_all_photos_with_the_steps_of_all_rounds():
    photos = made.photos(5)
    _, again = refit_with(photos[3:], photos[:3])
    once = fit(photos, replace(COARSE, steps=60 + 20 * 2))
    np.testing.assert_array_equal(again.field.means, once.field.means)
    np.testing.assert_array_equal(again.field.sh, once.field.sh)
    assert again.report.steps == 100 and again.report.new_views.taken


def test_the_rounds_that_photos_came_in_do_not_matter():
    photos = made.photos(5)
    _, at_once = refit_with(photos[3:], photos[:3])
    _, half = refit_with(photos[3:4], photos[:3])
    given = RefinementInput(half.field, half.grid, FRAME, photos[:4], photos[4:])
    after = refit.refit_from_scratch(given, MATCHED, SETTINGS, np.random.default_rng(0))
    np.testing.assert_array_equal(after.field.means, at_once.field.means)


def test_without_photos_the_field_goes_on():
    first, same = refit_with([])
    assert same.field is first.field and same.grid is first.grid


def test_photos_that_contradict_the_earlier_ones_change_nothing():
    wrong = [replace(view, image=np.ascontiguousarray(view.image[::-1, ::-1])) for view in made.photos(7)[3:]]
    first, same = refit_with(wrong)
    assert not same.report.new_views.taken
    assert same.field is first.field and same.grid is first.grid


@pytest.mark.parametrize("taken", [True, False])
def test_where_earlier_photos_lose_much_an_update_tells_whether_the_new_ones_are_right(monkeypatch, taken):
    photos = made.photos(5)
    monkeypatch.setattr(refit.regression_guard, "allowed_loss", lambda *_: -100.0 if len(asked) == 0 else 100.0)
    asked = []
    refine = refit.refine_field

    def update(*given):
        asked.append(given)
        found = refine(*given)
        return replace(found, report=replace(found.report, new_views=replace(found.report.new_views, taken=taken)))

    monkeypatch.setattr(refit, "refine_field", update)
    first, after = refit_with(photos[3:], photos[:3])
    assert len(asked) == 1 and after.report.new_views.taken == taken
    assert (after.field is first.field) == (not taken)


@pytest.mark.parametrize(("how", "steps"), [("continue", 40), ("scratch", 100)])
def test_the_preset_says_how(monkeypatch, how, steps):
    monkeypatch.setattr(refit, "match_points", lambda *_: MATCHED)
    photos = made.photos(5)
    first, files = fit(photos[:3]), refit.PhotoFiles("model", "images", 3, False)
    given = RefinementInput(first.field, first.grid, FRAME, photos[:3], photos[3:])
    preset = {"size": 48, "spacing": 1.0, "max_gaussians": 5000, "steps": 60, "steps_per_photo": 20, "refit": how}
    assert refit.update_field(given, preset, files, np.random.default_rng(0)).report.steps == steps


def test_chosen_photos_are_fitted_as_a_round_from_scratch_fits_them(monkeypatch):
    monkeypatch.setattr(refit, "match_points", lambda *_: MATCHED)
    photos = made.photos(5)
    preset = {"size": 48, "spacing": 1.0, "max_gaussians": 5000, "steps": 60, "steps_per_photo": 20}
    files = refit.PhotoFiles("model", "images", 3, False)
    once = refit.fit_chosen_photos(photos, FRAME, preset, files, np.random.default_rng(0))
    _, again = refit_with(photos[3:], photos[:3])
    np.testing.assert_array_equal(once.field.means, again.field.means)
    np.testing.assert_array_equal(once.grid.heights, again.grid.heights)
    assert once.report.steps == 100


@pytest.mark.parametrize(("whole", "margin"), [(True, ground.WHOLE), (False, ground.MARGIN)])
def test_photos_that_structure_from_motion_does_not_know_bring_no_points(tmp_path, whole, margin):
    views, none = made.photos(3), np.zeros(0, int)
    cameras = tuple(view.camera for view in views[:2])
    model = ColmapModel(tuple(view.name for view in views[:2]), cameras, *NONE, none, none, np.zeros((0, 2)))
    (tmp_path / "sparse").mkdir()
    write_colmap_model(model, tmp_path / "sparse")
    for view in views[:2]:
        image_files.write_png(tmp_path / f"{view.name}.png", view.image)
        (tmp_path / f"{view.name}.png").rename(tmp_path / view.name)
    matched = refit.match_points(views, refit.PhotoFiles(tmp_path / "sparse", tmp_path, 2, whole))
    assert matched.points.shape == (0, 3) and matched.margin == margin
