"""Inpainting by a prior with known samples: what changes, what must not change, and what is marked."""

from dataclasses import fields as members
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as patch

from dav_gswt.field import GaussianField, concatenate_fields, rgb_to_sh
from dav_gswt.inpainting import build
from dav_gswt.reconstruction import discs
from dav_gswt.views.scoring import PriorConfig

FIRST = 20  # column of the first unseen cell
SEEN = patch.look(*np.meshgrid(0.05 + 0.1 * np.arange(FIRST), 0.05 + 0.1 * np.arange(32))).mean((0, 1))
BANDS = SEEN + np.float32([[0.2, -0.2, 0.1], [-0.2, 0.2, -0.1]])  # of which the mean is the colour of known ground
BAND = 8  # pixels of a picture that have one of them


class BandPrior:
    """Samples are bands of two colours where the render is not valid, and the render itself elsewhere."""

    name, size, small = "bands", 32, False

    def __init__(self, spoil=None, light=1.0):
        self.spoil, self.light = spoil, np.float32(light)

    def sample(self, condition, m, p_drop, steps, seed, known=None, common=True):
        assert p_drop == 0 and not common
        hidden = np.kron(~known, np.ones((1, build.CELL, build.CELL), bool))[..., None]
        bands = BANDS[np.arange(self.size) // BAND % 2][None, :, None]
        colour = np.where(hidden, bands, condition.colour)
        planes = [self.light * colour, condition.alpha[..., None], condition.inverse_depth[..., None]]
        return np.repeat(np.concatenate(planes, -1).transpose(0, 3, 1, 2)[:, None], m, 1).astype(np.float32)

    def decode(self, latents):
        planes = np.ascontiguousarray(latents.transpose(0, 1, 3, 4, 2))
        if self.spoil is not None:
            planes[0, 0, 3, 4, self.spoil] = np.nan
        return planes[..., :4]


def config(prior=None, samples=2):
    return PriorConfig(prior or BandPrior(), samples, 2, 0.0)


def half_seen():
    """A ground whose east no photo saw: grey, as if filled, and uncertain."""
    grid = patch.grid()
    seen = grid.seen.copy()
    seen[:, FIRST:] = False
    field = patch.field(grid)
    east = build.select_gaussians(field, grid, ~seen)
    sh = field.sh.copy()
    sh[east] = 0
    uncertainty = np.where(east, np.float32(1), np.float32(0.1))
    return replace(field, sh=sh, uncertainty=uncertainty), replace(grid, seen=seen)


def inpaint(field, grid, prior=None):
    return build.inpaint_field(field, grid, patch.FRAME, patch.photos(), config(prior))


def distance_to_bands(colours):
    """How far colours are from the nearer of the two."""
    return np.abs(colours[..., None, :] - BANDS).max(-1).min(-1)


def same(one: GaussianField, two: GaussianField) -> bool:
    return all(np.array_equal(getattr(one, f.name), getattr(two, f.name)) for f in members(GaussianField))


def test_unseen_ground_takes_the_colour_of_the_prior_and_all_else_keeps_its_bytes():
    field, grid = half_seen()
    before = field[:], grid.seen.copy()
    made = inpaint(field, grid)
    n, marked = grid.heights.size, made.field.imagined
    assert np.array_equal(marked[:n].reshape(grid.shape), ~grid.seen) and np.array_equal(made.inpainted, ~grid.seen)
    assert same(made.field[~marked], field[~marked])
    inner = np.zeros(grid.shape, bool)
    inner[4:-4, FIRST + 4 : -4] = True
    off = distance_to_bands(made.field.base_colours[:n][inner.ravel()])
    assert np.median(off) < 0.08  # between two bands colours mix, and far in they keep to the mean
    assert distance_to_bands(field.base_colours[:n][inner.ravel()]).min() > 0.1
    assert (made.field.uncertainty[marked] == 1).all()
    assert np.array_equal(made.field.means, field.means)  # no height is moved
    assert same(field, before[0]) and np.array_equal(grid.seen, before[1])  # nothing is changed in place
    count = {"unseen": 32 * 12, "painted": 32 * 12}
    assert made.describe(grid) == {"cells": n, **count, "exemplar": count, "changed": True}
    rows = discs.find_underlay(made.field, grid)
    under = made.field[rows].base_colours.reshape(16, 16, 3)  # the colour of the discs above it
    assert np.median(distance_to_bands(under[3:-3, 13:-2])) < 0.1
    assert np.array_equal(marked[rows].reshape(16, 16), np.tile(np.arange(16) >= FIRST // 2, (16, 1)))


def test_where_photos_saw_everything_the_field_is_returned():
    field = patch.field()
    made = inpaint(field, patch.grid())
    assert made.field is field and made.inpainted.sum() == made.unseen.sum() == 0
    assert not made.describe(patch.grid())["changed"]


def test_ground_under_a_known_object_is_not_inpainted():
    field, grid = half_seen()
    lid = blob([2.7, 0.6, 0.3], [0.35, 0.35, 0.02], [0.1, 0.9, 0.1])
    made = inpaint(concatenate_fields([field, lid]), grid)
    covered = (np.hypot(grid.centres[:, 0] - 2.7, grid.centres[:, 1] - 0.6) < 0.2).reshape(grid.shape)
    assert covered.any() and not made.inpainted[covered].any() and made.unseen[covered].all()
    assert np.array_equal(made.field.imagined[: covered.size].reshape(grid.shape), made.inpainted)
    assert same(made.field[len(field) : len(field) + 1], lid)
    roof = concatenate_fields([field, blob([2.6, 1.6, 0.3], [2.0, 3.0, 0.02], [0.1, 0.9, 0.1])])
    hidden = inpaint(roof, grid)
    assert hidden.field is roof and hidden.unseen.any() and not hidden.inpainted.any()


def test_a_prior_with_samples_that_are_not_finite_is_refused():
    with pytest.raises(ValueError, match="is not finite"):
        inpaint(*half_seen(), BandPrior(spoil=3))


def blob(place, sizes, colour):
    return GaussianField(
        np.float32([place]),
        np.log(np.float32([sizes])),
        np.float32([[1, 0, 0, 0]]),
        np.full(1, 6.0, np.float32),
        rgb_to_sh(np.array([colour], float)),
        np.zeros(1, np.float32),
        np.zeros(1, bool),
    )


MIDDLE = [1.6, 1.6, 0.0]


def test_no_camera_is_inside_an_object_or_under_the_ground():
    def place(target, *more):
        return build.place_camera(target, concatenate_fields([patch.field(), *more]), patch.grid(), patch.FRAME, 32)

    ((_, camera),) = place(np.array(MIDDLE))
    assert place(np.array(MIDDLE), blob(list(camera.centre), [0.4, 0.4, 0.4], [0.5, 0.5, 0.5])) == []
    assert place(np.array([1.6, 1.6, -9.0])) == []
