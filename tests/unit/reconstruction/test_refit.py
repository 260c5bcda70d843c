"""First fields, and rounds whose field is fitted from scratch."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.photos.colmap_model import ColmapModel, write_colmap_model
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import coarse, ground, refit
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings, UpdateSettings
from dav_gswt.reconstruction.objects import make_blobs
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.refinement import RefinementInput

COARSE = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=12)
SETTINGS = refit.ScratchSettings(COARSE, UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=20), start=3)
NONE = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
MATCHED = refit.MatchedPoints(*NONE, 0.15)
FRAME = replace(made.FRAME, kind="synthetic")
PRESET = {"size": 48, "spacing": 1.0, "max_gaussians": 5000, "steps": 12, "steps_per_photo": 20}
FILES = refit.PhotoFiles("model", "images", 3, False)


def fit(photos, settings=COARSE):
    return fit_coarse_field(StartViews(FRAME, photos, *NONE, 0.15), settings, np.random.default_rng(0))


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    found = fit(photos, replace(COARSE, steps=20))
    assert np.isfinite(found.field.means).all() and found.report.steps == 20
    assert evaluate_field(found.field, mask_to_ground(photos[:1], found.grid))["psnr"] == pytest.approx(30, abs=12)


def test_a_free_fit_starts_with_points_from_everywhere_and_room_to_grow():
    points = np.sort(np.random.default_rng(0).uniform(0, 1, (4000, 3)), axis=0)
    quality, rng = replace(COARSE, max_gaussians=1000), np.random.default_rng(1)
    start, _ = coarse._start_from_points(points, np.full((4000, 3), 0.5, np.float32), quality, rng)
    assert len(start) == int(coarse.START_SHARE * 1000)
    assert start.means[:, 0].min() < 0.05 and start.means[:, 0].max() > 0.95


def test_a_scene_without_a_ground_is_fitted_as_free_gaussians():
    """Points all over a cube, of which no height field explains more than a slice."""
    rng = np.random.default_rng(0)
    points = rng.uniform(0.4, 2.8, (400, 3))
    colours = rng.uniform(0.2, 0.8, (400, 3)).astype(np.float32)
    truth = make_blobs(points, colours, np.full(400, 0.06))
    photos = []
    for i in range(6):
        camera = cameras.pinhole([1.6 + 5 * np.cos(i), 1.6 + 5 * np.sin(i), 3.0], [1.6, 1.6, 1.6], 48, 48, 40.0)
        seen = render(truth, camera)
        image = np.clip(seen.colour / np.maximum(seen.alpha, 0.5)[..., None], 0, 1).astype(np.float32)
        photos.append(TrainingView(f"photo_{i}", camera, image, (seen.alpha > 0.5).astype(np.float32)))
    frame = replace(FRAME, flying_height=3.0)
    quality = replace(COARSE, max_gaussians=2000, steps=150)
    given = StartViews(frame, photos, points, np.full((400, 3), 0.5, np.float32))
    found = fit_coarse_field(given, quality, np.random.default_rng(0))
    assert not found.field.ground.any()
    grey = replace(truth, sh=rgb_to_sh(np.full((400, 3), 0.5)))
    assert evaluate_field(found.field, photos)["psnr"] > evaluate_field(grey, photos)["psnr"] + 1


def refit_with(new):
    earlier = made.photos(3)
    first = fit(earlier)
    given = RefinementInput(first.field, first.grid, FRAME, earlier, new)
    return first, refit.refit_from_scratch(given, MATCHED, SETTINGS, np.random.default_rng(0))


def test_rounds_and_chosen_photos_are_one_fit_to_all_photos_unless_the_preset_says_to_continue(monkeypatch):
    monkeypatch.setattr(refit, "match_points", lambda *_: MATCHED)
    photos = made.photos(5)
    once, first = fit(photos, replace(COARSE, steps=12 + 20 * 2)), fit(photos[:3])
    given = RefinementInput(first.field, first.grid, FRAME, photos[:3], photos[3:])
    again, continued = (
        refit.update_field(given, PRESET | {"refit": how}, FILES, np.random.default_rng(0))
        for how in ("scratch", "continue")
    )
    chosen = refit.fit_chosen_photos(photos, FRAME, PRESET, FILES, np.random.default_rng(0))
    for found in (again, chosen):
        np.testing.assert_array_equal(found.field.means, once.field.means)
        np.testing.assert_array_equal(found.field.sh, once.field.sh)
        np.testing.assert_array_equal(found.grid.heights, once.grid.heights)
        assert found.report.steps == 52
    assert again.report.new_views.taken and continued.report.steps == 40


def test_no_photos_and_those_that_contradict_the_earlier_ones_change_nothing():
    wrong = [replace(view, image=np.ascontiguousarray(view.image[::-1, ::-1])) for view in made.photos(7)[3:]]
    for new in ([], wrong):
        first, same = refit_with(new)
        assert same.report.new_views.taken == (not new)
        assert same.field is first.field and same.grid is first.grid


@pytest.mark.parametrize("taken", [True, False])
def test_where_earlier_photos_lose_much_an_update_tells_whether_the_new_ones_are_right(monkeypatch, taken):
    asked, refine = [], refit.refine_field
    monkeypatch.setattr(refit.regression_guard, "allowed_loss", lambda *_: 100.0 if asked else -100.0)

    def update(*given):
        asked.append(given)
        found = refine(*given)
        return replace(found, report=replace(found.report, new_views=replace(found.report.new_views, taken=taken)))

    monkeypatch.setattr(refit, "refine_field", update)
    first, after = refit_with(made.photos(5)[3:])
    assert len(asked) == 1 and after.report.new_views.taken == taken
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
        matched = refit.match_points(views, refit.PhotoFiles(tmp_path / "sparse", tmp_path, 2, whole))
        assert matched.points.shape == (0, 3) and matched.margin == margin
