"""Which ground photos miss: holes, hidden ground, coarse photos, and what a second flight mends."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures import photos as synth
from fixtures.frames import scene_frame

from dav_gswt.geometry.georeference import Georeference
from dav_gswt.photos import gaps
from dav_gswt.photos.gaps import REASONS, Surface, find_gaps, find_seen_cells

NO_PHOTO, _, ONE_SIDE, TOO_COARSE = REASONS
PLACE = Georeference(52.0, 13.0, 40.0, north=30.0, metres_per_unit=1.0)
FRAME = scene_frame(kind="photos", unit="metre", flying_height=1.0, georeference=PLACE)
STEP, SIDE = 0.25, 9


def fly(keep=lambda x, y: True, height=lambda x, y: 1.0, side=SIDE):
    """Photos straight down on a grid; a photo shows 1.067 x 0.8 of the plane per unit of height."""
    at = [(STEP * (j - side // 2), STEP * (i - side // 2)) for i in range(side) for j in range(side)]
    return [synth.camera((x, y, height(x, y))) for x, y in at if keep(x, y)]


def model_of(cameras, relief=0.0):
    return synth.model(cameras, synth.plain(1500, 1.6, np.random.default_rng(0), relief))


def flat(cell=0.02, half=1.0):
    count = round(2 * half / cell)
    return Surface(-half, -half, cell, np.zeros((count, count)))


def test_a_whole_flight_misses_nothing_though_its_margin_is_seen_from_one_side():
    found = find_gaps(model_of(fly(), relief=0.01), FRAME)
    assert found.gaps == () and found.horizon == ()
    assert found.area > (STEP * (SIDE - 1)) ** 2
    assert found.pixel == pytest.approx(1 / synth.FOCAL, rel=0.05)


def test_a_hole_in_the_flight_is_one_gap_of_the_size_that_geometry_says():
    """Photos nearer than .75 to the middle are left out: x within .75 - .533 and y within .75 - .4 is unseen."""
    (gap,) = find_gaps(model_of(fly(lambda x, y: max(abs(x), abs(y)) > 0.6)), FRAME).gaps
    assert gap.areas[NO_PHOTO] == pytest.approx(2 * 0.217 * 2 * 0.35, abs=0.03)  # a cell more or less at the border
    assert set(gap.areas) == {NO_PHOTO, ONE_SIDE}, "a column of photos shows three of each cell at its border"
    assert np.abs(gap.middle[:2]).max() < 0.1


def test_the_far_side_of_a_wall_is_hidden_as_far_as_the_line_of_sight_says():
    """A trench .3 deep between x = 0 and .2. From x = -.5, z = 1 its floor is hidden up to x = .15."""
    surface = flat()
    x = surface.centres[:, 0].reshape(surface.heights.shape)
    trench = (x > 0) & (x < 0.2)
    surface = replace(surface, heights=np.where(trench, -0.3, 0.0))
    seen = np.zeros(trench.size, bool)
    seen[find_seen_cells(synth.camera((-0.5, 0, 1), (0, 0.001, 0)), surface, 4.0)] = True
    middle = np.abs(surface.centres[:, 1]) < 0.01
    floor = middle & trench.ravel()
    assert np.array_equal(seen[floor], x.ravel()[floor] > 0.15 + surface.cell / 2)  # and half a cell of tolerance
    level = middle & ~trench.ravel() & (np.abs(x.ravel()) < 0.4)
    assert seen[level & (x.ravel() < 0)].all() and seen[level & (x.ravel() > 0.25)].all()
    above = synth.camera((0.1, 0, 1), (0.1, 0.001, 0))
    assert set(np.flatnonzero(floor)) <= set(find_seen_cells(above, surface, 4.0).tolist())


def test_ground_that_was_flown_over_too_high_is_seen_too_coarsely():
    found = find_gaps(model_of(fly(height=lambda x, y: 2.6 if x > 0.3 else 1.0)), FRAME)
    assert {gap.reason for gap in found.gaps} == {TOO_COARSE}
    assert found.gaps[0].middle[0] > 0.5  # photos from x = .25 show ground up to .78 finely


def test_blurred_photos_and_those_of_the_horizon_do_not_count():
    sparse = model_of(fly())
    near = [name for name, c in zip(sparse.names, sparse.cameras, strict=True) if np.abs(c.centre[:2]).max() < 0.6]
    assert find_gaps(sparse, FRAME).gaps == ()
    assert NO_PHOTO in find_gaps(sparse, FRAME, near).gaps[0].areas
    level = synth.camera((0, 0, 1), (10, 0, 0.5))
    found = find_gaps(model_of([*fly(), level]), FRAME)
    assert found.horizon == (f"{SIDE**2:03d}.png",) and found.gaps == ()


@pytest.mark.parametrize("hole, height", [(0.6, lambda x: 1.0), (0.0, lambda x: 2.6 if x > 0.3 else 1.0)])
def test_few_planned_photos_fill_every_gap(hole, height):
    cameras = fly(lambda x, y: max(abs(x), abs(y)) >= hole, lambda x, y: height(x))
    found = find_gaps(model_of(cameras), FRAME)
    planned = gaps.plan_photos(found, FRAME, cameras[0])
    assert found.gaps and 3 <= len(planned) <= 16
    assert all(camera.centre[2] == pytest.approx(1.0, abs=0.05) for camera in planned)
    again = find_gaps(model_of([*cameras, *planned]), FRAME)
    assert again.gaps == ()
    assert gaps.plan_photos(again, FRAME, cameras[0]) == []


def measure_area(ring):
    """Inside a closed line, positive if it runs counterclockwise."""
    x, y = ring.T
    return 0.5 * (x[:-1] * y[1:] - x[1:] * y[:-1]).sum()


def test_outlines_are_counterclockwise_closed_and_lie_on_earth():
    fault = np.full((40, 40), gaps.WELL)
    fault[10:20, 5:25] = 0
    fault[12:18, 10:15] = gaps.WELL  # an island that is seen well
    surface = Surface(-1.0, -2.0, 0.1, np.full((40, 40), 3.0))
    (gap,) = gaps.list_gaps(fault, surface)
    found = gaps.Gaps(surface, fault, (gap,), 16.0, 0.01, ())
    (feature,) = gaps.describe_gaps(found, FRAME)["features"]
    outer, inner = (np.array(ring) for ring in feature["geometry"]["coordinates"])
    assert (outer[0] == outer[-1]).all() and measure_area(outer) > 0 > measure_area(inner)
    world = PLACE.to_world(np.c_[outer[:, ::-1], np.full(len(outer), 43.0)])
    assert np.allclose([world[:, :2].min(0), world[:, :2].max(0)], [[-0.5, -1.0], [1.5, 0.0]], atol=0.01)
    assert feature["properties"]["area"] == pytest.approx((200 - 30) * 0.01)
    assert feature["properties"]["reason"] == NO_PHOTO
    bare = gaps.describe_gaps(found, scene_frame(unit="flying height"))["features"][0]
    assert np.allclose(np.min(bare["geometry"]["coordinates"][0], 0), [-0.5, -1.0])
