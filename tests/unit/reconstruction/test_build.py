from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView, mask_outside_ground
from dav_gswt.raster import render
from dav_gswt.reconstruction import top_view, underlay
from dav_gswt.reconstruction.coarse import fit_coarse_field
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fit_settings import FitSettings
from dav_gswt.reconstruction.observation import mask_to_ground
from dav_gswt.reconstruction.opacity_uncertainty import estimate_uncertainty
from dav_gswt.reconstruction.refinement import refine_field

QUALITY = FitSettings(size=48, spacing=1.0, max_gaussians=5000, steps=40, steps_per_photo=10, level_steps=5)


def test_ground_that_no_photo_sees_is_uncertain_and_the_rest_is_not():
    photos = [replace(photo, weight=photo.weight.copy()) for photo in made.photos(1)]
    photos[0].weight[:, :24] = 0
    field = estimate_uncertainty(made.field(), photos)
    field = field[field.ground]
    pixels, _ = photos[0].camera.project(field.means.astype(float))
    inside = (pixels > 2).all(1) & (pixels < 46).all(1)
    assert field.uncertainty[inside & (pixels[:, 0] > 27)].max() < 0.1
    assert field.uncertainty[inside & (pixels[:, 0] < 21)].min() == 1


def test_a_map_from_above_has_the_south_in_its_first_row():
    grid = made.grid()
    found = top_view.render_top_view(made.field(grid), grid)
    true = made.look(*grid.centres[:, :2].T).reshape(*grid.shape, 3)
    inner = np.s_[3:-3, 3:-3]
    # coplanar discs are blended by their index, which moves the picture by a part of a cell
    assert np.abs(found.colour[inner] - true[inner]).mean() < 0.02
    assert np.abs(found.colour[::-1][inner] - true[inner]).mean() > 0.05
    np.testing.assert_allclose(found.height[inner], 0, atol=2e-3)


def test_a_refinement_without_photos_hands_the_field_on():
    field, grid = made.field(), made.grid()
    same = refine_field(field, grid, made.FRAME, made.photos(), [], QUALITY, np.random.default_rng(0))
    assert same.field is field and same.grid is grid


def test_a_refinement_colours_ground_that_only_the_new_photo_sees():
    seen = made.grid().seen.copy()
    seen[:, 16:] = False
    grid = replace(made.grid(), seen=seen)
    field = made.field()
    sh = field.sh.copy()
    sh[: seen.size][~seen.ravel()] = 0  # mid-grey, as if filled
    frame = replace(made.FRAME, kind="synthetic")
    photos = made.photos(2)
    after = refine_field(replace(field, sh=sh), grid, frame, photos[:1], photos[1:], QUALITY, np.random.default_rng(0))
    assert after.grid.seen.sum() > seen.sum()
    fresh = np.flatnonzero((after.grid.seen & ~seen).ravel())
    true = made.look(*grid.centres[fresh, :2].T)
    assert np.abs(after.field.base_colours[fresh] - true).mean() < 0.05


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    none = np.zeros((0, 3)), np.zeros((0, 3), np.float32)
    found = fit_coarse_field(made.FRAME, photos, *none, QUALITY, np.random.default_rng(0))
    assert np.isfinite(found.field.means).all()
    assert found.grid.cells % 32 == 0
    assert found.report.steps == QUALITY.steps
    assert evaluate_field(found.field, mask_to_ground(photos[:1], found.grid))["psnr"] == pytest.approx(30, abs=12)


def test_a_field_has_its_underlay_after_its_discs_and_no_thing_is_lost_with_it():
    grid, field = made.grid(), made.field()
    assert underlay.find_rows(field, grid) == slice(
        grid.heights.size, grid.heights.size + underlay.count_gaussians(grid)
    )
    alone = underlay.remove_underlay(field, grid)
    assert alone.ground.all() and len(alone) == grid.heights.size
    assert underlay.find_rows(alone, grid).stop == grid.heights.size


def test_a_finished_field_with_fewer_gaussians_than_cells_has_no_underlay_to_lose():
    grid, field = made.grid(), made.field()
    few = replace(field, ground=np.zeros(len(field), bool))[: grid.heights.size // 2]
    assert underlay.remove_underlay(few, grid) is few


def test_no_sky_shines_through_the_ground_between_shrunken_discs():
    grid, field = made.grid(), made.field()
    scales = field.log_scales.copy()
    scales[: grid.heights.size, :2] = np.log(0.2 * grid.spacing)
    grains = replace(field, log_scales=scales)
    camera = cameras.pinhole([1.6, 0.0, 0.8], [1.6, 1.6, 0], 96, 96, 40.0)
    inside = mask_outside_ground(
        TrainingView("", camera, np.zeros((96, 96, 3), np.float32), np.ones((96, 96), np.float32)),
        0.4,
        0.4,
        2.8,
        2.8,
    )
    counts = inside.weight > 0
    assert render(underlay.remove_underlay(grains, grid), camera).alpha[counts].min() < 0.5  # there were holes
    assert render(grains, camera).alpha[counts].min() > 0.95


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
    found = fit_coarse_field(
        frame, photos, points, np.full((400, 3), 0.5, np.float32), quality, np.random.default_rng(0)
    )
    assert not found.field.ground.any()
    grey = replace(truth, sh=rgb_to_sh(np.full((400, 3), 0.5)))
    assert evaluate_field(found.field, photos)["psnr"] > evaluate_field(grey, photos)["psnr"] + 1
