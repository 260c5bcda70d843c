from dataclasses import replace

import numpy as np
import pytest
from fixtures import mixed_ground as made
from scipy.ndimage import gaussian_filter

from dav_gswt.materials import build, left_out
from dav_gswt.materials.objects import Footprint

M = made.CELLS
ROWS, COLUMNS = np.mgrid[:M, :M]


def box(top, bottom, left, right):
    return (top <= ROWS) & (bottom > ROWS) & (left <= COLUMNS) & (right > COLUMNS)


ROOF, HEDGE, CANOPY, TRENCH = box(10, 40, 10, 45), box(50, 56, 10, 70), box(100, M, 0, M), box(0, 90, 76, 84)
HEAP = 12 * np.clip(1 - np.hypot(ROWS - 60, COLUMNS - 106) / 18, 0, 1)  # cells, slope 2/3


def built_up():
    """Sand with a roof, a hedge and a wood, which the ground layer lies below, and a trench and a heap."""
    maps, rng = made.maps(mixed=False, shrubs=False), np.random.default_rng(0)
    colour = maps.colour.copy()
    for cells, paint in (
        (ROOF, (0.5, 0.2, 0.15)),
        (HEDGE, made.GRASS),
        (CANOPY, made.SHRUB),
        (TRENCH, (0.4, 0.3, 0.2)),
    ):
        colour[cells] = paint + rng.normal(0, 0.03, (cells.sum(), 3))
    ground = HEAP - 6.0 * TRENCH + gaussian_filter(rng.normal(0, 1, (M, M)), 1)
    above = 10.0 * ROOF + 6.0 * HEDGE + 15.0 * CANOPY
    height, surface = ((part + 0.02 * COLUMNS) * made.SPACING for part in (ground, ground + above))
    return replace(maps, colour=np.clip(colour, 0, 1), height=height, surface=surface, cover=(above > 0).astype(float))


@pytest.mark.parametrize("followed", [False, True])
def test_roofs_hedges_woods_and_trenches_are_in_no_tile_and_a_heap_is_ground(followed, caplog):
    """followed: the ground layer lies on the roof and the hedge, as where all photos agree on them."""
    maps = built_up()
    if followed:
        maps = replace(maps, height=maps.surface, cover=np.zeros((M, M)))
    with caplog.at_level("INFO"):
        plan = build.plan_ground(maps, True)
    shown = np.any([*plan.sources, plan.classes.occupied], 0)
    for cells in (ROOF, HEDGE, CANOPY, TRENCH):
        assert not (shown & cells).any()
    assert shown[(HEAP > 0) & ~TRENCH].mean() > 0.95
    reasons = [each.reason for each in plan.left_out]
    assert reasons.count(left_out.STANDS) == 3 and reasons.count(left_out.SUNK) == 1
    assert "left out: 3 roofs, hedges or canopies" in caplog.text


def average_cells(maps, factor, rng):
    """The maps as a draft has them: wider cells, softer colours, and heights with specks."""
    cells = maps.cells // factor

    def average(layer):
        return layer.reshape(cells, factor, cells, factor, *layer.shape[2:]).mean((1, 3))

    place = replace(maps.exemplar, spacing=factor * maps.exemplar.spacing, cells=cells)
    layers = {name: average(getattr(maps, name)) for name in ("colour", "height", "cover")}
    surface = average(maps.surface) + 3 * place.spacing * (rng.random((cells, cells)) < 0.01)
    return replace(maps, **layers, surface=surface, known=np.ones((cells, cells), bool), exemplar=place), average


def test_with_the_wider_cells_of_a_draft_no_piece_of_what_is_left_out_is_an_object():
    """The hedge is too low there to stand, and its ends are blobs."""
    maps, average = average_cells(built_up(), 2, np.random.default_rng(1))
    shrub = average((np.hypot(ROWS - 80, COLUMNS - 30) <= 6).astype(float))  # this is an object
    colour = np.where(shrub[..., None] > 0.5, made.SHRUB, maps.colour)
    plan = build.plan_ground(replace(maps, colour=colour, surface=maps.surface + 6 * made.SPACING * shrub), True)
    (thing,) = (each.cells for each in plan.classes.footprints)
    assert thing[shrub > 0.5].mean() > 0.7
    for cells in (ROOF, HEDGE, CANOPY, TRENCH):
        assert not (thing & (average(cells.astype(float)) > 0)).any()


@pytest.mark.parametrize("factor", [1, 2])
def test_pipes_are_left_out_whole(factor):
    """Three that lie side by side, as high as they are wide."""
    maps = made.maps(mixed=False)
    pipes = np.any([box(66 + 12 * k, 74 + 12 * k, 70 - 3 * k, 120 - 3 * k) for k in range(3)], 0) & ~made.shrub_cells()
    colour = np.where(pipes[..., None], [0.5, 0.35, 0.3], maps.colour)
    maps = replace(maps, colour=colour, surface=maps.surface + 8 * made.SPACING * pipes, cover=maps.cover + pipes)
    maps, average = average_cells(maps, factor, np.random.default_rng(1))
    plan = build.plan_ground(maps, True)
    lying = average(pipes.astype(float)) > 0.5
    assert len(plan.classes.footprints) == len(made.SHRUBS)
    assert not any((each.cells & lying).any() for each in plan.classes.footprints)
    assert not np.any([source[lying].any() for source in plan.sources])


@pytest.mark.parametrize("share", [0.5, 0.7])
def test_patches_of_flowers_all_over_the_ground_are_ground_and_a_shed_among_them_is_not(share):
    maps, noise = made.maps(mixed=False, shrubs=False), np.random.default_rng(0).normal(0, 1, (M, M))
    patches = gaussian_filter(noise, 6)
    flowers = (patches > np.quantile(patches, 1 - share)) & ~ROOF
    surface = maps.height + (9 * flowers + 40 * ROOF) * made.SPACING
    colour = np.where(ROOF[..., None], [0.5, 0.2, 0.15], maps.colour)
    plan = build.plan_ground(replace(maps, colour=colour, surface=surface, cover=0.5 * (flowers | ROOF)), True)
    assert plan.sources[0][flowers].mean() > 0.9 and not plan.sources[0][ROOF].any()
    assert [each.reason for each in plan.left_out] == [left_out.STANDS]


def test_people_may_name_what_stands(tmp_path):
    from dav_gswt.images import image_files

    image_files.write_png(tmp_path / "wood.png", np.repeat(CANOPY[::-1, :, None], 3, 2).astype(float))
    plan = build.plan_ground(built_up(), True, {"wood": tmp_path / "wood.png"})
    assert plan.sources[0].sum() > 0.9 * CANOPY.sum() and not plan.left_out


def test_ground_below_a_wall_rises_no_more_than_the_slope():
    wall = np.where(np.arange(40) < 20, 0.0, 8.0) * np.ones((40, 1))
    wanted = np.minimum(wall, 0.5 * np.maximum(np.arange(40) - 19, 0))
    np.testing.assert_allclose(left_out.limit_slope(wall, 0.5), wanted, atol=1e-12)
    hill = 0.4 * np.abs(ROWS - 60.0)
    np.testing.assert_allclose(left_out.limit_slope(hill, 0.4), hill, atol=1e-12)


DISC = np.hypot(ROWS - 60, COLUMNS - 60) <= 9
NOTHING = np.zeros((M, M), bool)


@pytest.mark.parametrize(
    ("own", "unseen", "excluded", "flaw"),
    [
        (DISC, NOTHING, NOTHING, ""),
        (DISC & (COLUMNS < 62), NOTHING, COLUMNS >= 62, left_out.CUT),  # straight along excluded ground
        (DISC, NOTHING, ~DISC & (np.hypot(ROWS - 60, COLUMNS - 66) <= 11), ""),  # its own shade
        (DISC & (COLUMNS < 66), COLUMNS >= 66, COLUMNS >= 66, left_out.CUT),  # along ground that no photo saw
    ],
)
def test_things_that_are_cut_off_are_no_objects(own, unseen, excluded, flaw):
    maps = made.maps(mixed=False, shrubs=False)
    assert left_out.find_flaw(Footprint(own, 0), maps, unseen, excluded) == flaw
    tall = replace(maps, surface=maps.surface + 8 * made.SPACING * own)  # what stands ends where it is high no more
    assert left_out.find_flaw(Footprint(own, 0), tall, unseen, excluded) == (flaw if unseen.any() else "")


@pytest.mark.parametrize(
    ("height", "tilt", "flaw"),
    [(16, None, ""), (24, None, left_out.ABOVE), (16, 20, left_out.ABOVE), (24, 60, ""), (2, 5, "")],
)
def test_a_thing_that_photos_saw_from_above_only_is_no_object(height, tilt, flaw):
    maps = made.maps(mixed=False, shrubs=False)
    maps = replace(maps, surface=maps.surface + height * made.SPACING * DISC)
    if tilt is not None:
        maps = replace(maps, tilt=np.full((M, M), float(tilt)))
    assert left_out.find_flaw(Footprint(DISC, 0), maps, NOTHING, NOTHING) == flaw


def test_what_was_left_out_is_said_in_words():
    things = [{"reason": left_out.STANDS, "share": 0.05}, {"reason": left_out.STANDS, "share": 0.03}]
    things += [{"reason": left_out.ABOVE, "share": 0.002}]
    assert left_out.describe_left_out(things) == [
        "2 roofs, hedges or canopies (8%)",
        "1 thing seen from above only",
    ]
