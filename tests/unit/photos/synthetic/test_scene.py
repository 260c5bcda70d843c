"""Synthetic scenes: what they refuse, that pictures are taken where cameras say, and that they repeat."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry import camera_layouts
from dav_gswt.geometry.cameras import pinhole, top_down
from dav_gswt.photos.synthetic import desert, land
from dav_gswt.photos.synthetic import scene as synthetic

mi = pytest.importorskip("mitsuba")
BARE = {"stones": 0, "pebbles": 0, "shrubs": 0, "tufts": 0}
ENTRY = {"family": "desert", "seed": 0, "photos": 8, "test": 6, "size": 64, "candidates": 20}
HIGH = ENTRY | {"layout": "cap", "min_elevation": 60, "photos": 24, "test": 12, "oblique": 8}


@pytest.fixture(autouse=True)
def coarse_sand(monkeypatch):
    """Sand of few texels: quick to make, and otherwise the same."""
    monkeypatch.setattr(desert, "TEXELS", 256)
    yield
    synthetic._load_scene.cache_clear(), synthetic._load_isolated.cache_clear()


def off_centre(width=96, height=64):
    """A camera that looks askance and whose principal point is far from the middle."""
    camera = pinhole((3.0, -4.0, 5.0), (0.3, 0.2, 0.0), width, height, 50.0)
    return replace(camera, cx=0.37 * width, cy=0.71 * height)


@pytest.mark.parametrize(
    "family, seed, given, said",
    [
        pytest.param("tundra", 0, {}, "tundra.*desert, meadow", id="family"),
        pytest.param("desert", -1, {}, "seed", id="negative seed"),
        pytest.param("desert", 0, {"shrub": 3}, "'shrub'.*shrubs", id="misspelt option"),
        pytest.param("desert", 0, {"shrubs": 1e9}, "shrubs.*0.0 to", id="too many"),
        pytest.param("desert", 0, {"undulation": float("nan")}, "undulation", id="NaN"),
        pytest.param("desert", 0, {"stones": "many"}, "stones", id="a word"),
    ],
)
def test_what_a_scene_cannot_be_is_said_by_name(family, seed, given, said):
    with pytest.raises(InputError, match=said):
        synthetic.make_scene(family, seed, **given)


def test_every_option_has_bounds_that_hold_its_default():
    assert set(land.option_bounds(desert.Options)) == set(desert.Options.__dataclass_fields__)
    for name, (low, high) in land.option_bounds(desert.Options).items():
        assert low <= getattr(desert.Options(), name) <= high
        for value in (low, high):
            land.make_options("desert", desert.Options, {name: value})


def test_points_of_light_appear_where_the_camera_projects_them():
    camera = off_centre()
    points = np.array([[0.0, 0.0, 0.0], [1.2, 0.4, 0.3], [-0.6, -0.9, 0.8], [0.3, 0.6, -0.4], [-0.9, 0.9, 0.1]])
    expected, depth = camera.project(points)
    sensor = mi.load_dict(synthetic.make_sensor(camera, {"type": "multijitter", "sample_count": 256}))
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    for point, pixel, z in zip(points, expected, depth, strict=True):
        assert 5 < pixel[0] < camera.width - 5 and 5 < pixel[1] < camera.height - 5
        ball = {"type": "sphere", "center": point.tolist(), "radius": float(2.0 * z / camera.fx)}
        world = mi.load_dict({"type": "scene", "ball": ball | {"light": {"type": "area"}}})
        light = np.array(mi.render(world, sensor=sensor, integrator=mi.load_dict({"type": "direct"}), spp=256))[..., 0]
        found = [(light * columns).sum() / light.sum(), (light * rows).sum() / light.sum()]
        # a ball of 2 pixels off the axis is seen as an ellipse whose middle is off by 2^2/f * tan < 0.03 pixels;
        # 256 rays a pixel leave 0.02 more
        assert found == pytest.approx(pixel, abs=0.06)


def test_depth_leads_back_to_the_ground():
    scene = synthetic.make_scene("desert", 0, **BARE)
    camera = off_centre()
    origin, step = camera.rays()
    depth = synthetic.render_depth(scene, camera)
    seen = origin + step * depth[..., None]
    ground = desert.make_land(scene.options, 0, scene.exemplar).ground
    near = np.abs(ground.vertices[:, :2]).max(axis=1) < 4
    grid = ground.vertices[near].reshape(np.sqrt(near.sum()).astype(int), -1, 3)
    axis = grid[0, :, 0]
    inside = np.abs(seen[..., :2]).max(axis=-1) < 3.9
    i, j = (np.clip(np.searchsorted(axis, seen[inside][:, k]), 1, len(axis) - 1) for k in (1, 0))
    corners = np.stack([grid[i - a, j - b, 2] for a in (0, 1) for b in (0, 1)])
    z = seen[inside][:, 2]
    assert inside.sum() > 2000
    assert (z > corners.min(axis=0) - 1e-4).all() and (z < corners.max(axis=0) + 1e-4).all()  # float32 at 7 m


def test_the_sky_is_infinitely_far():
    scene = synthetic.make_scene("desert", 0, **BARE)
    assert np.isinf(synthetic.render_depth(scene, pinhole((0, 0, 2), (0, 5, 12), 8, 8, 30.0))).all()


def test_the_mean_ground_of_the_exemplar_is_at_0():
    scene = synthetic.make_scene("desert", 4, undulation=0.4, **BARE)
    side, above = scene.exemplar, pinhole((0, 0, 1000.0), (0, 0, 0), 120, 120, np.degrees(2 * np.arctan(3.0 / 1000.0)))
    height = 1000.0 - synthetic.render_depth(scene, above)
    assert side == 6.0
    assert height.mean() == pytest.approx(0, abs=3e-3)  # two samplings of ripples of 20 mm
    assert height.std() > 0.05


def test_a_picture_repeats_to_the_byte_whatever_the_number_of_threads():
    import drjit

    scene, camera = synthetic.make_scene("desert", 0, shrubs=20, stones=40), off_centre(50, 38)
    before = drjit.thread_count()
    try:
        drjit.set_thread_count(1)
        one = synthetic.render(scene, camera, 4)
        drjit.set_thread_count(3)
        synthetic._load_scene.cache_clear()
        three = synthetic.render(scene, camera, 4)
    finally:
        drjit.set_thread_count(before)
    assert one.dtype == np.float32 and one.shape == (38, 50, 3)
    assert one.tobytes() == three.tobytes()
    assert one.min() >= 0 and one.max() <= 1 and one.std() > 0.02


def test_photos_taken_again_differ_in_their_noise_alone():
    scene, camera = synthetic.make_scene("desert", 0, **BARE), off_centre(50, 38)
    first, same, second = (synthetic.render(scene, camera, 4, again) for again in (0, 0, 1))
    assert first.tobytes() == same.tobytes() != second.tobytes()
    assert np.abs(first - second).mean() < 0.05
    assert np.abs(first.mean() - second.mean()) < 0.01  # a mean over blocks of pixels whose noise goes together


def test_another_seed_is_another_desert():
    camera = camera_layouts.orbit(90, 0, 7.0, (0, 0, 0), 24, 24, 55.0)
    one, other = (synthetic.render_depth(synthetic.make_scene("desert", seed), camera) for seed in (0, 1))
    assert np.abs(one - other).mean() > 0.02


def test_a_camera_that_mitsuba_cannot_hold_is_refused():
    scene = synthetic.make_scene("desert", 0, **BARE)
    with pytest.raises(ValueError, match="pinhole"):
        synthetic.render(scene, top_down(-1.0, -1.0, 8, 8, 0.25, 5.0))
    with pytest.raises(ValueError, match="square"):
        synthetic.render(scene, replace(off_centre(), fy=10.0))


def test_the_config_entry_tells_how_many_pictures_of_which_size():
    start, tests = synthetic.start_views(ENTRY), synthetic.test_views(ENTRY)
    assert (len(start), len(tests)) == (8, 6)
    assert {(c.width, c.height) for c in start + tests} == {(64, 64)}
    moved = synthetic.start_views(ENTRY, (10.0, 0.0, 0.0))
    assert moved[3].centre - start[3].centre == pytest.approx([10, 0, 0])


def test_the_start_views_see_the_whole_exemplar_from_at_least_three_sides():
    half = synthetic.make_scene("desert", 0).exemplar / 2
    ground = np.array([[x, y, 0.0] for x in np.linspace(-half, half, 13) for y in np.linspace(-half, half, 13)])
    seen = np.zeros(len(ground), int)
    for camera in synthetic.start_views(ENTRY):
        pixels, depth = camera.project(ground)
        seen += ((pixels > 0) & (pixels < 64)).all(axis=1) & (depth > 0)
    assert seen.min() >= 3


def elevations(cameras):
    """In degrees, about the origin."""
    return np.degrees([np.arcsin(c.centre[2] / np.linalg.norm(c.centre)) for c in cameras])


def test_a_scene_that_says_nothing_else_is_photographed_from_a_ring_and_tested_on_the_hemisphere():
    assert elevations(synthetic.start_views(ENTRY)) == pytest.approx([90] + 7 * [65])
    assert elevations(synthetic.test_views(ENTRY)).min() >= 30
    assert synthetic.test_groups(ENTRY) == {"hemisphere": [0, 1, 2, 3, 4, 5]}


def test_a_cap_is_photographed_and_tested_evenly_from_above_its_lowest_elevation():
    low = np.sin(np.radians(60))
    for cameras, count in (
        (synthetic.start_views(HIGH), 24),
        (synthetic.test_views(HIGH)[:12], 12),
    ):
        height = np.sort(np.sin(np.radians(elevations(cameras))))
        # equal steps of height are equal areas of the sphere
        assert height == pytest.approx(low + (np.arange(count) + 0.5) / count * (1 - low), abs=1e-9)


def test_views_at_45_degrees_are_a_group_of_their_own():
    groups = synthetic.test_groups(HIGH)
    assert groups == {"high": list(range(12)), "oblique": list(range(12, 20))}
    tests = synthetic.test_views(HIGH)
    assert len(tests) == 20
    assert elevations(tests[12:]) == pytest.approx(8 * [45])


def test_a_paper_rig_is_tested_on_the_hemisphere():
    entry = ENTRY | {"layout": "paper", "photos": 100}
    assert (np.abs(elevations(synthetic.start_views(entry)) - 45) < 1e-9).sum() == 36
    assert elevations(synthetic.start_views(entry)).min() > 30
    assert synthetic.test_groups(entry) == {"hemisphere": list(range(6))}


def test_walkers_are_a_group_of_their_own_and_look_over_the_exemplar_to_the_horizon():
    entry = HIGH | {"walkers": 6}
    groups, tests = synthetic.test_groups(entry), synthetic.test_views(entry, (10.0, 0.0, 0.0))
    assert list(groups) == ["high", "oblique", "walker"] and groups["walker"] == list(range(20, 26))
    own = [tests[i] for i in groups["walker"]]
    assert [c.centre[2] for c in own] == pytest.approx([0.8, 1.6, 3.2, 0.8, 1.6, 3.2])
    around = np.degrees(np.unwrap([np.arctan2(c.centre[1], c.centre[0] - 10.0) for c in own]))
    assert np.diff(around) == pytest.approx(5 * [60.0])
    for camera in own:
        pixels, _ = camera.project(np.array([[10.0, 0.0, 0.0], camera.centre + 50 * camera.forward * [1, 1, 0]]))
        assert (pixels > 0).all() and (pixels < 64).all()  # the middle of the exemplar and the horizon
        assert pixels[1, 1] < pixels[0, 1]
        assert camera.width == camera.height == 64


@pytest.mark.parametrize("rig", ["cap", "paper"])
def test_no_view_is_another(rig):
    entry = HIGH | {"layout": rig, "walkers": 6}
    cameras = synthetic.start_views(entry) + synthetic.test_views(entry)
    at = np.array([c.centre for c in cameras])
    assert np.linalg.norm(at[:, None] - at, axis=-1)[~np.eye(len(at), dtype=bool)].min() > 0.1


@pytest.mark.parametrize(
    "light, code", [(0.0, 0.0), (1.0, 1.0), (7.0, 1.0), (-1.0, 0.0), (0.5, 0.7353570), (0.002, 0.02584)]
)
def test_light_is_encoded_as_srgb(light, code):
    assert synthetic.encode_srgb(np.array([light]))[0] == pytest.approx(code, abs=1e-6)
