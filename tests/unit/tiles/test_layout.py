"""Geometry of tiles, and landmarks, which are kept out of what all tiles share."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.tiles import energy, layout, patches, search


@pytest.mark.parametrize("levels", [1, 3, 6, 8, layout.AUTO])
@pytest.mark.parametrize("exemplar", [32, 100, 448])
@pytest.mark.parametrize("strip", [0.05, 0.125, 0.3])
def test_a_tile_is_whole_in_the_cells_of_every_level(exemplar, levels, strip):
    plan = layout.plan_layout(exemplar, levels, 0.5, strip, fitted=3)
    assert plan.side <= exemplar and plan.side % 2 ** (plan.levels - 1) == 0
    assert plan.composed_levels <= 3 and plan.block == 2 ** (plan.composed_levels - 1)
    assert plan.side >= layout.MIN_BLOCKS * plan.block
    assert not any(v % plan.block for v in (plan.strip, plan.corner))
    assert plan.block < plan.strip < plan.corner < plan.side / 2
    # the first coarser level is composed of patches, too
    assert plan.composed_levels > 1 or plan.levels == 1 or plan.side < 2 * layout.MIN_BLOCKS


def test_auto_makes_the_levels_that_are_ever_drawn():
    # at least 3.5 cells of the coarsest level, rounded to four: 112 / 32 = 3.5, 96 / 32 = 3
    for side, levels in ((128, 6), (112, 6), (96, 5), (60, 5), (32, 4), (20, 3)):
        plan = layout.plan_layout(4 * side, layout.AUTO, 0.25, 0.125)
        assert plan.levels == levels and abs(plan.side - side) <= 2 ** (levels - 2)


def test_an_exemplar_smaller_than_any_tile_is_refused():
    with pytest.raises(InputError, match="needs 10 ground cells a side and the exemplar has 9"):
        layout.plan_layout(9, 3, 0.5, 0.16)


def own(picture):
    """A patch's own square, which is not charged."""
    return (picture**2).sum(-1).mean()


def test_a_landmark_is_what_stands_out_of_its_surroundings_not_a_shade_or_grain():
    y, x = np.mgrid[:120, :120]
    maps = np.random.default_rng(0).normal(0, 0.02, (120, 120, 2)) + 0.05 * np.sin(x / 40)[..., None]
    maps[(x - 30) ** 2 + (y - 80) ** 2 < 20, 1] += 0.5
    found = patches.find_landmarks(maps, 60)
    spot = (x - 30) ** 2 + (y - 80) ** 2 < 300
    assert found[80, 30] > 0 and (found[~spot] > 0).mean() < 0.01
    assert found.mean() == pytest.approx(1)
    assert not patches.find_landmarks(np.ones((120, 120, 2)), 60).any()


@pytest.mark.parametrize("seed", range(3))
def test_hardly_a_landmark_lies_in_what_all_tiles_share(seed):
    rng, m = np.random.default_rng(seed), 160
    colour = 0.5 + 0.05 * rng.normal(size=(m, m, 1)).repeat(3, 2)
    spots = [(24 + 28 * (k % 5), 24 + 28 * (k // 5)) for k in range(25)]
    y, x = np.mgrid[:m, :m]
    for place in spots:
        colour[(x - place[0]) ** 2 + (y - place[1]) ** 2 < 7] += 0.4
    plan = layout.Layout(m, 1, 60, 6, 9)
    flat = np.zeros((m, m))
    guide = patches.make_guidance(colour, flat, flat, plan)
    energy_of = energy.SeamEnergy("colour", 2.0, energy.make_colour_layer(colour), None)
    problem = search.SearchProblem(plan, guide, energy_of, 300, 2)
    found = search.search_patches(problem, 1, np.random.default_rng(seed))
    labels, shifts = found.labels, [layout.label_shifts(plan, found.places, tile) for tile in range(16)]
    shown = [guide.landmarks[layout.source_cells(*pair)] > 0 for pair in zip(labels, shifts, strict=True)]
    frame, centre = (
        np.mean([marks[pick(own)].mean() for marks, own in zip(shown, labels, strict=True)])
        for pick in (lambda own: own > 0, lambda own: own == 0)
    )
    assert frame < 0.2 * centre
