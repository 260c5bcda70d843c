"""Positions along a line, and positions within their own error, against a made-up flight."""

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.photos.sfm import gps
from dav_gswt.photos.sfm.registration import _find_up

HEIGHT = 40.0  # metres: a flying height


def reconstruct(model):
    """A reconstruction of the model's cameras and points, without observations."""
    out = pycolmap.Reconstruction()
    for i, camera in enumerate(model.cameras, 1):
        params = [camera.fx, camera.fy, camera.cx, camera.cy]
        lens = pycolmap.Camera(camera_id=i, model="PINHOLE", width=camera.width, height=camera.height, params=params)
        out.add_camera_with_trivial_rig(lens)
        image = pycolmap.Image(image_id=i, name=model.names[i - 1], camera_id=i)
        out.add_image_with_trivial_frame(image, pycolmap.Rigid3d(np.c_[camera.rotation, camera.translation]))
    for point in model.points:
        out.add_point3D(point, pycolmap.Track())
    return out


def place(model, rng, noise):
    """GPS positions of the model's cameras, turned by 30 degrees about the vertical."""
    c, s = np.cos(0.5), np.sin(0.5)
    true = HEIGHT * np.array([camera.centre for camera in model.cameras]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]]
    return dict(zip(model.names, true + rng.normal(0, noise, true.shape), strict=True))


def test_heights_that_drift_along_a_line_do_not_say_where_up_is():
    along = np.linspace(0, 200, 12)
    drifting = np.c_[along, np.zeros(12), 60 + 12 * np.sin(along / 60)]
    assert not gps.measure_spread(drifting)[1]
    assert gps.measure_spread(np.c_[along, 30 * np.cos(along), np.full(12, 60.0)])[1]


@pytest.mark.parametrize("seed", range(5))
def test_photos_along_a_line_leave_the_ground_level(seed):
    """Ten photos on 90 metres, receivers 2 metres off: about the line the positions say nothing."""
    rng = np.random.default_rng(seed)
    model = synth.model(synth.flight(1, 10, step=0.25), synth.plain(500, 1.0, rng))
    best = reconstruct(model)
    assert gps.align_to_gps(best, place(model, rng, 2.0), _find_up(best, 0))
    down = np.array([best.images[i].cam_from_world().rotation.matrix()[2] for i in best.reg_image_ids()])
    assert (down[:, 2] < -0.99).all()  # as the model has them, upright
    centres = np.array([best.images[i].projection_center() for i in sorted(best.reg_image_ids())])
    assert np.linalg.norm(centres[-1] - centres[0]) == pytest.approx(90, rel=0.1)


def test_positions_within_their_own_error_give_no_scale():
    """Another group of photos, which found no place, may spread the set's positions."""
    rng = np.random.default_rng(3)
    model = synth.model(synth.flight(2, 4, step=0.2), synth.plain(500, 1.0, rng))
    best = reconstruct(model)
    assert not gps.align_to_gps(best, dict.fromkeys(model.names, np.array([5.0, 5.0, 30.0])), _find_up(best, 0))
    near = {name: rng.normal(0, 1.0, 3) for name in model.names}
    assert not gps.align_to_gps(best, near, _find_up(best, 0))
    assert best.images[1].projection_center() == pytest.approx(model.cameras[0].centre)


def test_a_similarity_in_the_plane_has_no_mirror():
    rng = np.random.default_rng(1)
    a = np.c_[rng.normal(0, 50, 20), np.zeros(20)]
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    scale, found, shift, off = gps.fit_similarity(a, 2 * a @ turn.T + [3.0, -4.0])
    assert scale == pytest.approx(2) and found == pytest.approx(turn) and shift == pytest.approx([3, -4]) and off < 1e-9
