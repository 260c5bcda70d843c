"""Photos taken later with the lens of a scene."""

import numpy as np
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.photos.lenses import undistort_scene_photo


def test_a_photo_held_upright_is_turned_to_the_shape_of_the_sensor(tmp_path):
    camera = synth.camera((0, 0, 1))
    photo = np.random.default_rng(0).random((synth.HEIGHT, synth.WIDTH, 3)).astype(np.float32)
    upright = np.ascontiguousarray(np.rot90(photo, -1))  # as EXIF's orientation 6 shows it
    assert np.array_equal(undistort_scene_photo(upright, tmp_path, camera), photo)
    assert np.array_equal(undistort_scene_photo(photo, tmp_path, camera), photo)
    with pytest.raises(InputError, match="uncropped$"):
        undistort_scene_photo(upright[:200], tmp_path, camera)
