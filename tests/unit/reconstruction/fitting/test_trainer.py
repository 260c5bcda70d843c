"""What a fit finds, keeps and removes, and what does not change it."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import concatenate_fields, rgb_to_sh
from dav_gswt.reconstruction import top_view
from dav_gswt.reconstruction.evaluation import evaluate_field
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs


def grey(field):
    return replace(field, sh=rgb_to_sh(np.full((len(field), 3), 0.5)))


def blotched(field):
    noise = np.random.default_rng(3).normal(0, 0.15, (len(field), 3))
    return replace(field, sh=rgb_to_sh(field.base_colours + noise))


def constrain():
    return GroundConstraints(made.grid(), np.full((32, 32), 0.5))


def fitted(field=None, plan=None, photos=None):
    field = grey(made.field()) if field is None else field
    plan = plan or FitPlan(60, len(field))
    return trainer.fit_field(field, photos or made.photos(), plan, constrain(), np.random.default_rng(0))


def same(a, b):
    for name, values in vars(a).items():
        np.testing.assert_array_equal(values, getattr(b, name))


def test_a_fit_finds_the_colours_that_the_photos_show():
    photos, start = made.photos(), blotched(made.field())
    before = evaluate_field(start, photos[:1])["psnr"]
    assert evaluate_field(fitted(start).field, photos[:1])["psnr"] > before + 6


def test_things_above_the_ceiling_go_and_the_rest_stays():
    points = np.array([[1.6, 1.6, 3.0], [1.6, 1.6, 0.2]])
    field = concatenate_fields([made.field(), make_blobs(points, np.full((2, 3), 0.5), np.full(2, 0.05))])
    found = fitted(field, FitPlan(12, 1)).field
    assert len(found) == len(field) - 1
    assert found.means[-1, 2] == pytest.approx(0.2, abs=0.1)


def test_a_fit_grows_to_its_cap_and_no_further_and_its_ground_stays_a_ground():
    field, grid = grey(made.field()), made.grid()
    found = fitted(field, FitPlan(30, len(field) + 200)).field
    assert len(field) < len(found) <= len(field) + 200
    discs = found[: grid.heights.size]
    assert discs.ground.all()
    assert np.abs(discs.means[:, :2] - grid.centres[:, :2]).max() <= 0.49 * grid.spacing + 1e-6
    assert discs.opacity_logits.min() >= 2.5
    assert top_view.render_top_view(found, grid).alpha[2:-2, 2:-2].min() > 0.97  # closed, away from the border


def test_a_photo_with_another_exposure_does_not_change_the_field():
    photos = made.photos(3)
    dark = [photos[0], photos[1], replace(photos[2], image=(0.85 * photos[2].image).astype(np.float32))]
    plain, levelled = (fitted(photos=p, plan=FitPlan(90, 1)).field for p in (photos, dark))
    gone = evaluate_field(plain, photos[:2])["psnr"] - evaluate_field(levelled, photos[:2])["psnr"]
    assert gone < 3  # without levelling the common ground would be 5 % too dark: 26 dB at best, 8 dB lost


def blind(photo):
    return replace(photo, image=np.ones_like(photo.image), weight=np.zeros_like(photo.weight))


def test_photos_without_a_pixel_that_counts_change_nothing():
    photos, plan = made.photos(4), FitPlan(14, 1400, sh_degree=1)
    some = [blind(photos[0]), *photos[:2], *map(blind, photos), *photos[2:]]
    alone, among = (fitted(plan=plan, photos=p) for p in (photos, some))
    same(alone.field, among.field)
    assert alone.report == among.report
    field = made.field()
    found = fitted(field, FitPlan(10, 1), photos=[blind(p) for p in made.photos()]).field
    np.testing.assert_array_equal(found.base_colours[found.ground], field.base_colours[field.ground])
