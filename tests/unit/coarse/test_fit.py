from dataclasses import replace

import made_up_ground as made
import numpy as np
import pytest

from dav_gswt.active.evaluation import evaluate
from dav_gswt.coarse import build, doubt, maps
from dav_gswt.coarse.fit import fit
from dav_gswt.field import joined, sh_of

QUALITY = build.Quality(size=48, spacing=1.0, cap=5000, steps=40, steps_per_photo=10, level_steps=5)


def grey(field):
    return replace(field, sh=sh_of(np.full((len(field), 3), 0.5)))


def test_a_fit_finds_the_colours_that_the_photos_show():
    grid, photos = made.grid(), made.photos()
    before = evaluate(grey(made.field()), photos[:1])["psnr"]
    fitted = fit(grey(made.field()), grid, photos, 60, 0.5, np.random.default_rng(0), "test")
    assert evaluate(fitted, photos[:1])["psnr"] > before + 6


def test_the_ground_stays_a_ground():
    grid = made.grid()
    fitted = fit(made.field(), grid, made.photos(), 30, 0.5, np.random.default_rng(0), "test")
    assert len(fitted) == grid.heights.size and fitted.ground.all()
    away = np.abs(fitted.means[:, :2] - grid.centres[:, :2]).max()
    assert away <= 0.49 * grid.spacing + 1e-6  # each disc keeps to its cell
    assert fitted.opacity_logits.min() >= 2.5
    assert maps.from_above(fitted, grid).alpha[2:-2, 2:-2].min() > 0.97  # closed, away from the border


def test_the_same_seed_gives_the_same_bits_whatever_the_threads(monkeypatch):
    found = []
    for threads in ("1", "2"):
        monkeypatch.setenv("DAV_GSWT_THREADS", threads)
        found.append(fit(grey(made.field()), made.grid(), made.photos(), 15, 0.5, np.random.default_rng(7), "test"))
    for name, values in vars(found[0]).items():
        np.testing.assert_array_equal(values, getattr(found[1], name))


def test_things_that_leave_the_band_go():
    from dav_gswt.field import Field

    high = Field(
        np.array([[1.6, 1.6, 3.0]], np.float32),
        np.full((1, 3), np.log(0.1), np.float32),
        np.array([[1, 0, 0, 0]], np.float32),
        np.zeros(1, np.float32),
        sh_of(np.full((1, 3), 0.5)),
        np.zeros(1, np.float32),
        np.zeros(1, bool),
    )
    fitted = fit(joined([made.field(), high]), made.grid(), made.photos(), 12, 0.5, np.random.default_rng(0), "test")
    assert fitted.ground.all()


def test_ground_that_no_photo_sees_is_uncertain_and_the_rest_is_not():
    photos = [replace(photo, weight=photo.weight.copy()) for photo in made.photos(1)]
    photos[0].weight[:, :24] = 0
    field = doubt.with_uncertainty(made.field(), photos)
    pixels, _ = photos[0].camera.project(field.means.astype(float))
    inside = (pixels > 2).all(1) & (pixels < 46).all(1)
    assert field.uncertainty[inside & (pixels[:, 0] > 27)].max() < 0.1
    assert field.uncertainty[inside & (pixels[:, 0] < 21)].min() == 1


def test_a_map_from_above_has_the_south_in_its_first_row():
    grid = made.grid()
    found = maps.from_above(made.field(grid), grid)
    true = made.look(*grid.centres[:, :2].T).reshape(*grid.shape, 3)
    inner = np.s_[3:-3, 3:-3]
    # coplanar discs are blended by their index, which moves the picture by a part of a cell
    assert np.abs(found.colour[inner] - true[inner]).mean() < 0.02
    assert np.abs(found.colour[::-1][inner] - true[inner]).mean() > 0.05
    np.testing.assert_allclose(found.height[inner], 0, atol=1e-3)


def test_an_update_without_photos_hands_the_field_on():
    field, grid = made.field(), made.grid()
    same, ground = build.update(field, grid, made.FRAME, made.photos(), [], QUALITY, np.random.default_rng(0))
    assert same is field and ground is grid


def test_an_update_colours_ground_that_only_the_new_photo_sees():
    seen = made.grid().seen.copy()
    seen[:, 16:] = False
    grid = replace(made.grid(), seen=seen)
    field = made.field()
    sh = field.sh.copy()
    sh[~seen.ravel()] = 0  # mid-grey, as if filled
    frame = made.FRAME | {"kind": "synthetic"}
    photos = made.photos(2)
    updated, after = build.update(
        replace(field, sh=sh), grid, frame, photos[:1], photos[1:], QUALITY, np.random.default_rng(0)
    )
    assert after.seen.sum() > seen.sum()
    fresh = (after.seen & ~seen).ravel()
    true = made.look(*grid.centres[fresh, :2].T)
    assert np.abs(updated.base_colours[fresh] - true).mean() < 0.05


def test_a_coarse_field_from_photos_alone():
    photos = made.photos(4)
    points = np.zeros((0, 3))
    field, grid = build.coarse(
        made.FRAME, photos, points, np.zeros((0, 3), np.float32), QUALITY, np.random.default_rng(0)
    )
    assert np.isfinite(field.means).all()
    assert grid.cells % 32 == 0
    assert evaluate(field, build.modelled(photos[:1], grid))["psnr"] == pytest.approx(30, abs=12)
