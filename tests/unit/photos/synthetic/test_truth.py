"""What pictures of synthetic scenes show: depth and labels, against positions that are known and the pictures."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry.cameras import pinhole
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import desert, renderer, truth
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic.labels import GroundLabels, LandObject
from dav_gswt.photos.synthetic.land import Land, Light
from dav_gswt.photos.synthetic.meshes import Mesh

pytest.importorskip("mitsuba")
RED, GREEN, BLUE = np.eye(3).tolist()
BESIDE = pinhole((0.0, -6.0, 3.0), (0.0, 0.0, 0.4), 90, 60, 60.0)


def box(size, colour, at=(0.0, 0.0, 0.0)):
    """A cube on the ground, a face's corners its own."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    faces, corners = [], []
    for axis in range(3):
        for side in (0.0, 1.0):
            quad = np.insert(square, axis, side, axis=1)
            faces += [np.array([0, 1, 2]) + 4 * len(corners), np.array([0, 2, 3]) + 4 * len(corners)]
            corners.append(quad)
    vertices = (np.concatenate(corners) - [0.5, 0.5, 0.0]) * size + at
    colours = np.tile(np.array(colour, np.float32), (len(vertices), 1))
    return Mesh(vertices.astype(np.float32), np.array(faces), colours, False)


@pytest.fixture
def simple(monkeypatch):
    """Flat ground at z = 0; a stone, a cube of 1 at x = -1; a plant, a cube of 0.8 at x = 1. All in plain colours.

    Both are objects. The material is 2 for 2 metres to the east of the origin, then 1 for as many, and so on.
    """

    def make_land(options, seed, exemplar):
        edge = 40.0
        corners = np.array([[-edge, -edge, 0], [edge, -edge, 0], [edge, edge, 0], [-edge, edge, 0]], np.float32)
        ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(np.float32(RED), (4, 1)), False)
        albedo = np.tile(np.float32(RED), (2, 2, 1))
        light = Light(60.0, 30.0, np.ones(3), np.ones(3), np.ones(3), np.ones(3))
        places = np.array([[0, 1.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.0]])
        stone, shrub = box(1.0, GREEN, (-1.0, 0.0, 0.0)), box(0.8, BLUE, (1.0, 0.0, 0.0))
        things = LandObject("boulder", stone.vertices), LandObject("shrub", shrub.vertices)
        labels = GroundLabels({"sand": 1, "turf": 2}, np.array([[2, 1], [2, 1]]), 4.0, things, frozenset({0}))
        return Land(ground, albedo, 4.0, stone, [box(1.0, BLUE)], places, light, labels)

    family = SimpleNamespace(make_land=make_land, Options=desert.Options)
    monkeypatch.setitem(synthetic.FAMILIES, "simple", family)
    synthetic._load_scene.cache_clear(), synthetic._load_isolated.cache_clear()
    yield synthetic.make_scene("simple", 0)
    synthetic._load_scene.cache_clear(), synthetic._load_isolated.cache_clear()


def expected(camera):
    """Depth and label by hand: the nearest of the plane z = 0 and the two boxes along every pixel's ray."""
    origin, step = camera.rays()
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -origin[..., 2] / step[..., 2]
        depth = np.where((t > 0) & (np.abs(origin + t[..., None] * step)[..., :2].max(-1) < 40), t, np.inf)
        label = np.where(np.isfinite(depth), truth.GROUND, truth.SKY)
        for middle, side, kind in ((-1.0, 1.0, truth.STONE), (1.0, 0.8, truth.PLANT)):
            low = np.array([middle - side / 2, -side / 2, 0.0])
            enter, leave = (low - origin) / step, (low + side - origin) / step
            near, far = np.minimum(enter, leave).max(-1), np.maximum(enter, leave).min(-1)
            hit = (near < far) & (near > 0) & (near < depth)
            depth, label = np.where(hit, near, depth), np.where(hit, kind, label)
    return depth, label


def test_depth_and_label_are_what_a_ray_through_the_pixel_s_centre_meets(simple):
    for camera in (BESIDE, replace(BESIDE, cx=30.0, cy=41.0)):
        depth, label = truth.render_truth(simple, camera)
        by_hand, kinds = expected(camera)
        assert set(np.unique(kinds)) == {0, 1, 2, 3}
        assert (label == kinds).mean() > 0.999  # a ray along an edge may meet either side of it
        same = label == kinds
        assert (np.isinf(depth) == (label == truth.SKY)).all()
        seen = same & np.isfinite(by_hand)
        assert depth[seen] == pytest.approx(by_hand[seen], rel=1e-5)  # float32


def test_a_file_keeps_depth_label_camera_material_object_and_what_they_mean(simple, tmp_path):
    truth.write_truth(tmp_path / "view_00.exr", simple, BESIDE)
    depth, label, camera = truth.read_truth(tmp_path / "view_00.exr")
    want = truth.render_truth(simple, BESIDE)
    assert (depth == want[0]).all() and (label == want[1]).all()
    assert (camera.rotation == BESIDE.rotation).all() and camera.fx == BESIDE.fx and camera.width == 90
    channels, header = image_files.read_exr(tmp_path / "view_00.exr")
    assert header["labels"] == '{"sky": 0, "ground": 1, "stone": 2, "plant": 3}'
    assert header["materials"] == '{"sand": 1, "turf": 2}'
    assert (channels["object"] == np.select([label == truth.STONE, label == truth.PLANT], [1, 2], 0)).all()
    origin, step = BESIDE.rays()
    seen = np.isfinite(depth)
    x = (origin + step * np.where(seen, depth, 0)[..., None])[..., 0]
    assert (channels["material"] == np.where(seen, np.where(x % 4 < 2, 2, 1), 0)).all()
    image_files.write_exr(tmp_path / "other.exr", {"Z": np.zeros((2, 2))})
    with pytest.raises(InputError, match="no depth, labels and camera"):
        truth.read_truth(tmp_path / "other.exr")


def test_merged_plants_stand_where_instances_do():
    """The two ways to place a plant, for the variants that need one mesh of all."""
    renderer.load_mitsuba()
    from dav_gswt.photos.synthetic import mitsuba_scene

    stands = np.array([[1.0, 2.0, 0.5, 0.7, 1.1, 0.0, 0.0], [1.0, 2.0, 0.5, 0.7, 1.1, 0.2, -0.3]])
    plant = box(1.0, BLUE, (0.3, 0.1, 0.0))
    both = mitsuba_scene.transform_copies(plant, stands).reshape(2, -1, 3)
    for stand, copy in zip(stands, both, strict=True):
        matrix = np.array(mitsuba_scene.instance_transform(*stand).matrix)
        assert copy == pytest.approx(plant.vertices @ matrix[:3, :3].T + matrix[:3, 3], abs=1e-6)
