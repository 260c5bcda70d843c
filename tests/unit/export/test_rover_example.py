"""examples/rover: it stands on the exported ground, drives, and takes pictures."""

import importlib.util
from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import cover_content

from dav_gswt.export import ground_files, terrain_files
from dav_gswt.field import read_field

pytest.importorskip("mujoco", reason="mujoco is not installed")
pytestmark = pytest.mark.slow
FAR = np.array([0.5, 0.45, 0.35], np.float32)


@pytest.fixture(scope="module")
def rover(root):
    """The example, as a module."""
    found = importlib.util.spec_from_file_location("rover", root / "examples/rover/rover.py")
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def exports(cover_bundle, cover_terrain, export_settings, tmp_path_factory):
    """The folder that `dav-gswt export` writes, without objects: a rover may stop at a shrub; and the terrain."""
    out, terrain = tmp_path_factory.mktemp("exports"), replace(cover_terrain, scatter=None)
    settings = export_settings | {"columns": 8, "rows": 8, "formats": ["ply"]}
    terrain_files.export_terrain(terrain, cover_bundle.manifest, settings, out / "terrain")
    ground_files.export_ground(terrain, cover_bundle.manifest, cover_content().tiles, settings, out / "ground")
    return out, terrain


def test_it_drives_on_the_ground_and_sees_where_its_camera_looks(rover, exports):
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
    camera = rover.camera_of(model, data, "rover_eye")
    np.testing.assert_allclose(camera.centre, data.camera("rover_eye").xpos, atol=1e-9)
    np.testing.assert_allclose(camera.forward, -data.camera("rover_eye").xmat.reshape(3, 3)[:, 2], atol=1e-9)
    field, body = read_field(out / "terrain/terrain.ply"), rover.cover(model, data)
    shown = rover.take_picture(field, body, rover.follow(data, np.array([1.0, 0.0])), FAR)
    assert np.isfinite(shown).all() and np.ptp(shown) > 0.2
