"""Synthetic scenes: that pictures are taken where cameras say, and that they repeat."""

from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.geometry.cameras import pinhole
from dav_gswt.photos.synthetic import mitsuba_scene
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.land import Land, Light
from dav_gswt.photos.synthetic.meshes import Mesh

mi = pytest.importorskip("mitsuba")


@pytest.fixture(autouse=True)
def small(small_land):
    """Land that is quick to make."""


def off_centre(width=96, height=64):
    """A camera that looks askance and whose principal point is far from the middle."""
    camera = pinhole((3.0, -4.0, 5.0), (0.3, 0.2, 0.0), width, height, 50.0)
    return replace(camera, cx=0.37 * width, cy=0.71 * height)


def test_points_of_light_appear_where_the_camera_projects_them():
    camera = off_centre()
    points = np.array([[1.2, 0.4, 0.3], [-0.6, -0.9, 0.8], [-0.9, 0.9, 0.1]])
    expected, depth = camera.project(points)
    sensor = mi.load_dict(mitsuba_scene.make_sensor(camera, {"type": "multijitter", "sample_count": 256}))
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


def box(colour, at=(0.0, 0.0, 0.0)):
    """A cube of side 1 on the ground; each face has its own corners."""
    square, faces, corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float), [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            faces += [np.array([0, 1, 2]) + 4 * len(corners), np.array([0, 2, 3]) + 4 * len(corners)]
            corners.append(np.insert(square, axis, side, axis=1))
    vertices = (np.concatenate(corners) - [0.5, 0.5, 0.0] + at).astype(np.float32)
    return Mesh(vertices, np.array(faces), np.tile(np.array(colour, np.float32), (len(vertices), 1)))


def test_a_stone_a_plant_and_shadows_are_where_the_land_says():
    """Red ground at z = 0, a green stone at x = -1.5; a blue plant at x = 1.5 on a slope; the sun in the east."""
    corners = np.array([[-40, -40, 0], [40, -40, 0], [40, 40, 0], [-40, 40, 0]], np.float32)
    ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), None, smooth=True)
    albedo = np.tile(np.float32([0.8, 0.1, 0.1]), (2, 2, 1))
    light = Light(40.0, 0.0, (2.0, 2.0, 2.0), (0.05, 0.05, 0.2), (0.3, 0.1, 0.1), np.full(3, 0.1))
    size, yaw, slope = 0.8, 0.6, np.array([0.2, -0.3])
    places = np.array([[0, 1.5, 0.5, 0.25, size, yaw, *slope]])
    stone = box((0.1, 0.8, 0.1), (-1.5, 0.0, 0.0))
    world = mitsuba_scene.build_scene(Land(ground, albedo, 4.0, stone, [box((0.1, 0.1, 0.8))], places, light))

    def height(x, y):
        return 9.0 - world.ray_intersect(mi.Ray3f([x, y, 9.0], [0, 0, -1])).t

    for radius, turn, hit in ((0.2, 0.3, True), (0.5, np.pi / 4, True), (0.45, 0.0, False), (0.45, np.pi / 2, False)):
        off = radius * np.array([np.cos(yaw + turn), np.sin(yaw + turn)])
        assert height(1.5 + off[0], 0.5 + off[1]) == pytest.approx((0.25 + size + off @ slope) * hit, abs=1e-4)
    assert height(-1.1, 0.4) == pytest.approx(1.0, abs=1e-4) and height(-0.9, 0.4) == pytest.approx(0, abs=1e-4)
    camera = pinhole((0.0, 0.0, 8.0), (0.0, 0.0, 0.0), 64, 64, 60.0)
    seen = mitsuba_scene.render_light(world, camera, 16, 0)
    at = np.array([[-1.5, 0, 1.0], [1.5, 0.5, 1.05], [0, -2, 0], [-2.4, 0, 0], [-0.6, 0, 0]])
    column, row = camera.project(at)[0].astype(int).T
    colours = seen[row, column]
    assert colours[:3].argmax(axis=1).tolist() == [1, 2, 0]
    assert colours[2:].max(axis=1) == pytest.approx([0.37, 0.05, 0.37], abs=0.1)  # lit, in the stone's shadow, lit
    for target, colour in (((0.0, 0.0, 9.0), light.zenith), ((0.0, 9.0, 3.05), light.horizon)):
        sky = mitsuba_scene.render_light(world, pinhole((0.0, 0.0, 3.0), target, 16, 16, 1.0), 16, 0)
        assert sky[:7].mean(axis=(0, 1)) == pytest.approx(colour, rel=0.15)


def test_a_picture_repeats_to_the_byte_whatever_the_threads():
    import drjit

    scene, camera = synthetic.Scene("desert", 0), off_centre(50, 38)
    before = drjit.thread_count()
    try:
        drjit.set_thread_count(1)
        one = synthetic.render(scene, camera, 4)
        drjit.set_thread_count(3)
        synthetic.load_scene.cache_clear()
        three = synthetic.render(scene, camera, 4)
    finally:
        drjit.set_thread_count(before)
    assert one.dtype == np.float32 and one.shape == (38, 50, 3)
    assert one.tobytes() == three.tobytes()
    assert one.min() >= 0 and one.max() <= 1 and one.std() > 0.02
