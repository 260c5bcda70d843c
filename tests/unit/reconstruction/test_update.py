"""First fields, and rounds whose field is fitted from scratch."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.reconstruction import coarse, ground, regression_guard, update
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fitting.plan import UPDATE_RATE, FitSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.update import UpdateInput

SETTINGS = FitSettings(size=48, spacing=1.0, max_gaussians=5000, steps=12, steps_per_photo=20)
NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
FRAME = replace(made.FRAME, kind="synthetic")
PRESET = {"size": 48, "spacing": 1.0, "max_gaussians": 5000, "steps": 12, "steps_per_photo": 20}
FILES = update.PhotoFiles("model", "images", 3, False)


def start_of(photos, points=NONE[0]):
    return StartViews(FRAME, photos, points, np.full(points.shape, 0.5, np.float32), 0.15)


def fit(photos, settings=SETTINGS):
    return fit_coarse_field(start_of(photos), settings, np.random.default_rng(0))


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    found = fit(photos, replace(SETTINGS, steps=20))
    assert np.isfinite(found.field.means).all() and found.report.steps == 20
    assert evaluate_field(found.field, mask_to_ground(photos[:1], found.grid))["psnr"] == pytest.approx(30, abs=12)


def updated_from_scratch(new):
    earlier = made.photos(3)
    first = fit(earlier)
    given = UpdateInput(first.field, first.grid, FRAME, earlier, new)
    start = start_of(earlier + new)
    return first, update.update_from_scratch(given, start, SETTINGS, 3, np.random.default_rng(0))


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
    assert again.report.taken and continued.report.steps == 40


def test_steps_grow_with_the_photos_and_an_update_begins_with_lower_rates():
    assert [SETTINGS.plan_coarse_fit(n).steps for n in (3, 8, 10)] == [12, 12, 52]
    assert [SETTINGS.from_scratch(start, 12).steps for start in (3, 10)] == [12 + 9 * 20, 52 + 2 * 20]
    plans = [SETTINGS.plan_update(n, 3) for n in (2, 0)]
    assert [plan.steps for plan in plans] == [60, 60] and [plan.first_rate for plan in plans] == [UPDATE_RATE, 1.0]


def test_no_photos_and_those_that_contradict_the_earlier_ones_change_nothing():
    wrong = [replace(view, image=np.ascontiguousarray(view.image[::-1, ::-1])) for view in made.photos(7)[3:]]
    for new in ([], wrong):
        first, same = updated_from_scratch(new)
        assert same.report.taken == (not new)
        assert same.field is first.field and same.grid is first.grid


@pytest.mark.parametrize("taken", [True, False])
def test_where_earlier_photos_lose_much_an_update_tells_whether_the_new_ones_are_right(monkeypatch, taken):
    asked, update_field = [], update.update_field
    monkeypatch.setattr(regression_guard, "allowed_loss", lambda *_: 100.0 if asked else -100.0)

    def updated(*given):
        asked.append(given)
        found = update_field(*given)
        return replace(found, report=replace(found.report, taken=taken))

    monkeypatch.setattr(update, "update_field", updated)
    first, after = updated_from_scratch(made.photos(5)[3:])
    assert len(asked) == 1 and after.report.taken == taken
    assert (after.field is first.field) == (not taken)


def test_photos_that_structure_from_motion_does_not_know_bring_no_points(tmp_path):
    views, none = made.photos(3), np.zeros(0, int)
    names, known = tuple(view.name for view in views[:2]), tuple(view.camera for view in views[:2])
    model = ColmapModel(names, known, *NONE, none, none, np.zeros((0, 2)))
    (tmp_path / "sparse").mkdir()
    write_colmap_model(model, tmp_path / "sparse")
    for view in views[:2]:
        image_files.write_png(tmp_path / f"{view.name}.png", view.image)
        (tmp_path / f"{view.name}.png").rename(tmp_path / view.name)
    for whole, margin in ((True, ground.WHOLE), (False, ground.MARGIN)):
        matched = coarse.read_start_views(FRAME, views, tmp_path / "sparse", tmp_path, whole)
        assert matched.points.shape == (0, 3) and matched.margin == margin
