"""True pictures of candidates."""

import numpy as np
import pytest
from fixtures import ground

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose, pose_offset
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import scene
from dav_gswt.views import true_pictures
from dav_gswt.views.scoring import scoring_camera

SIDE = 48
GRID, FIELD = ground.grid(), ground.field()
ENTRY = {"family": "desert", "seed": 0, "agent": "render"}


def candidates(width, height, count=1):
    """Places around the middle, at 45 degrees."""
    found = [Pose(f"p{i}.png", 45.0, 360.0 * i / count, 5.0) for i in range(count)]
    return [(pose, cameras.pinhole(pose_offset(pose), [0, 0, 0], width, height, 50.0)) for pose in found]


def noise(camera):
    return np.random.default_rng(0).uniform(0, 1, (camera.height, camera.width, 3)).astype(np.float32)


@pytest.mark.parametrize(
    "size, drawn",
    [
        pytest.param((384, 288), (384, 288), id="as the photo is taken"),
        pytest.param((1024, 512), (384, 192), id="no larger than it need be"),
        pytest.param((64, 32), (96, 48), id="no smaller than it is scored"),
    ],
)
def test_what_can_be_rendered_is_drawn_as_a_photo_then_shrunk(monkeypatch, size, drawn):
    taken = []
    monkeypatch.setattr(scene, "render", lambda world, camera: taken.append(camera) or noise(camera))
    pool = candidates(*size, count=2)
    views = list(true_pictures.render_truth(ENTRY, pool, "nowhere"))
    assert [(camera.width, camera.height) for camera in taken] == [drawn] * 2
    assert [view.name for view in views] == ["p0.png", "p1.png"]
    for view, camera, (_, whole) in zip(views, taken, pool, strict=True):
        (w, h), k = (view.camera.width, view.camera.height), drawn[0] // 96
        assert (w, h) == (96, drawn[1] // k) and np.allclose(view.camera.centre, whole.centre)
        assert view.camera.fx / w == pytest.approx(whole.fx / size[0]) == pytest.approx(camera.fx / drawn[0])
        means = noise(camera).reshape(h, k, w, k, 3).mean((1, 3))
        np.testing.assert_allclose(view.image, means, atol=1e-6)
        assert (view.weight == 1).all()


@pytest.mark.parametrize("size", [(144, 192), (109, 67)])
def test_a_replayed_scene_truly_shows_its_frames_without_what_is_masked(tmp_path, size):
    ((pose, camera),) = pool = candidates(*size)
    cover = np.ones((camera.height, camera.width), np.float32)
    cover[: camera.height // 2] = 0
    image_files.write_png(tmp_path / pose.name, np.dstack([noise(camera), cover]))
    (view,) = true_pictures.render_truth({"agent": "replay"}, pool, tmp_path)
    small = scoring_camera(camera)
    assert vars(view.camera).keys() == vars(small).keys() and view.camera.fx == small.fx
    assert view.image.shape == (small.height, small.width, 3) == (*view.weight.shape, 3)
    assert max(view.image.shape) == 96
    shrunk = image_files.shrink_image(noise(camera), small.width, small.height)
    np.testing.assert_allclose(view.image, shrunk, atol=0.5 / 255)
    middle = small.height // 2
    assert (view.weight[: middle - 1] == 0).all() and (view.weight[middle + 1 :] == 1).all()


def test_truth_is_not_known_where_photos_must_be_asked_for(tmp_path):
    with pytest.raises(InputError, match="handheld"):
        list(true_pictures.render_truth({"agent": "handheld"}, candidates(64, 64), tmp_path))
    with pytest.raises(InputError, match=r"p0\.png"):
        list(true_pictures.render_truth({"agent": "replay"}, candidates(128, 96), tmp_path))


def test_few_candidates_are_spread():
    chosen = true_pictures.spread_candidates(candidates(8, 8, count=12), 2)
    assert [pose.name for pose, _ in chosen] == ["p0.png", "p6.png"]
