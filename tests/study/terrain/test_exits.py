"""What exports become in programs that do not draw them, and the camera that one is told."""

import json

import numpy as np
import pytest

from dav_gswt.study.terrain import exits


def test_supersplat_is_told_the_eye_of_the_other_pictures_turned_about_z(tmp_path):
    (tmp_path / "terrain").mkdir()
    (tmp_path / "terrain/terrain.json").write_text('{"tile_side": 2.0}', encoding="utf-8")
    exits.write_supersplat_settings(tmp_path)
    pose = json.loads((tmp_path / "supersplat.json").read_text(encoding="utf-8"))["cameras"][0]["initial"]
    east, north, up = (2 * v for v in exits.EYE)
    assert pose["position"] == pytest.approx([-east, up, north])  # a file with y down has x east, y down, z north
    assert pose["fov"] == pytest.approx(63.7, abs=0.1)


def test_higher_ground_is_brighter_and_slopes_to_the_light_brighter_still():
    y, x = np.mgrid[0:64, 0:64] / 8.0
    picture = exits.shade(np.sin(x) + 0 * y, 0.125).astype(float).mean(2)
    assert picture.shape == (exits.HEIGHT, exits.HEIGHT)
    assert picture.std() > 5
