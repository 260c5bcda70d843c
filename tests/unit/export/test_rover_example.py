"""examples/rover: it stands on the exported ground, drives, and its camera sees what our stills show."""

import importlib.util
import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import cover_content

from dav_gswt.export import ground_files, terrain_files
from dav_gswt.field import read_field
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render
from dav_gswt.terrain import endless, stills

pytest.importorskip("mujoco", reason="mujoco is not installed")
FAR = np.array([0.5, 0.45, 0.35], np.float32)


@pytest.fixture(scope="module")
def rover(root):
    """The example, as a module."""
    found = importlib.util.spec_from_file_location("rover", root / "examples/rover/rover.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def exports(cover_bundle, hills, export_settings, tmp_path_factory):
    """The folder that `dav-gswt export` writes, without objects: a rover may stop at a shrub; and the terrain."""
    out, settings = tmp_path_factory.mktemp("exports"), export_settings | {"columns": 8, "rows": 8}
    terrain = replace(endless.terrain_from_bundle(cover_bundle, hills), scatter=None)
    settings |= {"formats": ["ply"], "axes": "z-up"}
    terrain_files.export_terrain(terrain, cover_bundle.manifest, settings, out / "terrain")
    ground_files.export_ground(terrain, cover_bundle.manifest, cover_content().tiles, None, settings, out / "ground")
    return out, terrain


def test_it_drives_on_the_ground(rover, exports):
    out, terrain = exports
    model, track = rover.build_model(out / "ground", (-4.0, 0.0)), []
    for data in rover.drive(model, 2.0):
        place = data.body("rover_chassis").xpos.copy()
        ground = terrain.heights.at(place[:1], place[1:2])[0][0]
        track.append([*place, place[2] - ground])
    track = np.array(track)
    assert len(track) == 20 and np.linalg.norm(track[-1, :2] - track[0, :2]) > 1
    # the axles lie a wheel's radius above the ground, to 10 cm of slopes and bounces
    assert (np.abs(track[8:, 3] - 0.15) < 0.1).all()


def test_its_camera_sees_what_the_still_shows(rover, exports, cover_bundle):
    """As a file shows what the terrain shows (test_terrain_files), but for what lies beyond the export."""
    out, terrain = exports
    model = rover.build_model(out / "ground", (-4.0, 0.0))
    *_, data = rover.drive(model, 1.0)
    camera = rover.camera_of(model, data, "rover_eye")
    np.testing.assert_allclose(camera.centre, data.camera("rover_eye").xpos, atol=1e-9)
    np.testing.assert_allclose(camera.forward, -data.camera("rover_eye").xmat.reshape(3, 3)[:, 2], atol=1e-9)
    field = read_field(out / "terrain/terrain.ply")
    seen = rover.take_picture(field, rover.cover(model, data), camera, FAR).astype(np.float32)
    wanted = stills.render_view(terrain, camera, cover_bundle.manifest.sky, cover_bundle.manifest.ground_colour)
    alone, body = render(field, camera), render(rover.cover(model, data), camera)
    depth = alone.depth / np.maximum(alone.alpha, 1e-3)
    counted = ((alone.alpha > 0.99) & (depth < 6) & (body.alpha < 0.01)).astype(np.float32)
    assert counted.mean() > 0.3
    assert psnr(seen, wanted, counted) > 34


def test_what_is_nearer_hides_what_is_behind(rover, exports):
    out, _ = exports
    model = rover.build_model(out / "ground", (-4.0, 0.0))
    *_, data = rover.drive(model, 0.5)
    camera = rover.follow(data, np.array([1.0, 0.0]))
    body = rover.cover(model, data)
    shown = rover.take_picture(read_field(out / "terrain/terrain.ply"), body, camera, FAR)
    (pixel,), _ = camera.project(data.geom("rover_deck").xpos[None] + [0, 0, 0.015])
    x, y = pixel.astype(int)
    assert shown[y, x, 2] > shown[y, x, 0], "the deck is blue"
    facts = json.loads((out / "terrain/terrain.json").read_text())
    assert facts["files"]["ply"] == "z-up"
