"""What pictures of synthetic scenes show: depth and labels, against positions that are known and the pictures."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from dav_gswt.geometry.cameras import camera_from_json, pinhole
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import scene as synthetic
from dav_gswt.photos.synthetic import truth
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
    """Flat ground at z = 0; a stone, a cube of 1 at x = -1; a plant, a cube of 0.8 at x = 1. All in plain colours."""

    def make_land(seed, exemplar):
        edge = 40.0
        corners = np.array([[-edge, -edge, 0], [edge, -edge, 0], [edge, edge, 0], [-edge, edge, 0]], np.float32)
        ground = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), np.tile(np.float32(RED), (4, 1)), False)
        albedo = np.tile(np.float32(RED), (2, 2, 1))
        light = Light(60.0, 30.0, (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), np.ones(3))
        places = np.array([[0, 1.0, 0.0, 0.0, 0.8, 0.0, 0.0, 0.0]])
        stone = box(1.0, GREEN, (-1.0, 0.0, 0.0))
        return Land(ground, albedo, 4.0, stone, [box(1.0, BLUE)], places, light)

    monkeypatch.setitem(synthetic.FAMILIES, "simple", SimpleNamespace(make_land=make_land))
    synthetic.load_scene.cache_clear(), truth.load_parts.cache_clear()
    yield synthetic.make_scene("simple", 0)
    synthetic.load_scene.cache_clear(), truth.load_parts.cache_clear()


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


def test_a_file_keeps_depth_label_camera_and_what_they_mean(simple, tmp_path):
    truth.write_truth(tmp_path / "view_00.exr", simple, BESIDE)
    channels, header = image_files.read_exr(tmp_path / "view_00.exr")
    depth, label = truth.render_truth(simple, BESIDE)
    assert (channels["Z"] == depth).all() and (channels["label"] == label).all()
    assert header["labels"] == '{"sky": 0, "ground": 1, "stone": 2, "plant": 3}'
    camera = camera_from_json(json.loads(header["camera"]))
    assert (camera.rotation == BESIDE.rotation).all() and camera.fx == BESIDE.fx and camera.width == 90
