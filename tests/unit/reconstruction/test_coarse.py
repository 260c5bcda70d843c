from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import coarse
from dav_gswt.reconstruction.coarse import StartViews, fit_coarse_field
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fit_settings import CoarseSettings
from dav_gswt.reconstruction.observation import mask_to_ground

QUALITY = CoarseSettings(size=48, spacing=1.0, max_gaussians=5000, steps=40)


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    found = fit_coarse_field(StartViews(made.FRAME, photos, *none), QUALITY, np.random.default_rng(0))
    assert np.isfinite(found.field.means).all()
    assert found.grid.cells % 32 == 0
    assert found.report.steps == QUALITY.steps
    assert evaluate_field(found.field, mask_to_ground(photos[:1], found.grid))["psnr"] == pytest.approx(30, abs=12)


def test_a_free_fit_starts_with_points_from_everywhere_and_room_to_grow():
    points = np.sort(np.random.default_rng(0).uniform(0, 1, (4000, 3)), axis=0)
    quality, rng = replace(QUALITY, max_gaussians=1000), np.random.default_rng(1)
    start, _ = coarse._start_from_points(points, np.full((4000, 3), 0.5, np.float32), quality, rng)
    assert len(start) == int(coarse.START_SHARE * 1000)
    assert start.means[:, 0].min() < 0.05 and start.means[:, 0].max() > 0.95


def test_a_scene_without_a_ground_is_fitted_as_free_gaussians():
    """Points all over a cube, of which no height field explains more than a slice."""
    rng = np.random.default_rng(0)
    points = rng.uniform(0.4, 2.8, (400, 3))
    colours = rng.uniform(0.2, 0.8, (400, 3)).astype(np.float32)
    from dav_gswt.reconstruction.objects import make_blobs

    truth = make_blobs(points, colours, np.full(400, 0.06))
    photos = []
    for i in range(6):
        camera = cameras.pinhole([1.6 + 5 * np.cos(i), 1.6 + 5 * np.sin(i), 3.0], [1.6, 1.6, 1.6], 48, 48, 40.0)
        seen = render(truth, camera)
        image = np.clip(seen.colour / np.maximum(seen.alpha, 0.5)[..., None], 0, 1).astype(np.float32)
        photos.append(TrainingView(f"photo_{i}", camera, image, (seen.alpha > 0.5).astype(np.float32)))
    frame = replace(made.FRAME, kind="synthetic", flying_height=3.0)
    quality = replace(QUALITY, max_gaussians=2000, steps=150)
    given = StartViews(frame, photos, points, np.full((400, 3), 0.5, np.float32))
    found = fit_coarse_field(given, quality, np.random.default_rng(0))
    assert not found.field.ground.any()
    grey = replace(truth, sh=rgb_to_sh(np.full((400, 3), 0.5)))
    assert evaluate_field(found.field, photos)["psnr"] > evaluate_field(grey, photos)["psnr"] + 1
