from dataclasses import replace

import numpy as np
from fixtures import ground as made

from dav_gswt.reconstruction.fit_settings import UpdateSettings
from dav_gswt.reconstruction.refinement import RefinementInput, refine_field

QUALITY = UpdateSettings(size=48, max_gaussians=5000, steps_per_photo=10)


def test_a_refinement_without_photos_hands_the_field_on():
    field, grid = made.field(), made.grid()
    same = refine_field(RefinementInput(field, grid, made.FRAME, made.photos(), []), QUALITY, np.random.default_rng(0))
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
    given = RefinementInput(replace(field, sh=sh), grid, frame, photos[:1], photos[1:])
    after = refine_field(given, QUALITY, np.random.default_rng(0))
    assert after.grid.seen.sum() > seen.sum()
    fresh = np.flatnonzero((after.grid.seen & ~seen).ravel())
    true = made.look(*grid.centres[fresh, :2].T)
    assert np.abs(after.field.base_colours[fresh] - true).mean() < 0.05
