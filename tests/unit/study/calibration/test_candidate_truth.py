"""What candidates truly show: the photo that would be taken, on the grid on which poses are scored."""

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.geometry import cameras
from dav_gswt.geometry.poses import Pose, pose_offset
from dav_gswt.images import image_files
from dav_gswt.photos.synthetic import desert, scene
from dav_gswt.study.calibration import truth
from dav_gswt.views.scoring import scoring_camera

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
    views = list(truth.render_truth(ENTRY, pool, "nowhere"))
    assert [(camera.width, camera.height) for camera in taken] == [drawn] * 2
    assert [view.name for view in views] == ["p0.png", "p1.png"]
    for view, camera, (_, whole) in zip(views, taken, pool, strict=True):
        (w, h), k = (view.camera.width, view.camera.height), drawn[0] // 96
        assert (w, h) == (96, drawn[1] // k) and np.allclose(view.camera.centre, whole.centre)
        assert view.camera.fx / w == pytest.approx(whole.fx / size[0]) == pytest.approx(camera.fx / drawn[0])
        means = noise(camera).reshape(h, k, w, k, 3).mean((1, 3))
        np.testing.assert_allclose(view.image, means, atol=1e-6)
        assert (view.weight == 1).all()


def test_a_synthetic_scene_truly_shows_its_photo(monkeypatch):
    pytest.importorskip("mitsuba")
    monkeypatch.setattr(desert, "TEXELS", 256)
    pool = candidates(128, 128)
    (view,) = truth.render_truth(ENTRY, pool, "nowhere")
    photo = scene.render(scene.scene_from_config(ENTRY), pool[0][1])
    scene._world.cache_clear()
    np.testing.assert_array_equal(view.image, image_files.shrink_image(photo, 96, 96))
    assert view.image.std() > 0.02


@pytest.mark.parametrize("size", [(192, 144), (144, 192), (109, 67)])
def test_a_replayed_scene_truly_shows_its_frames_without_what_is_masked(tmp_path, size):
    ((pose, camera),) = pool = candidates(*size)
    cover = np.ones((camera.height, camera.width), np.float32)
    cover[: camera.height // 2] = 0
    image_files.write_png(tmp_path / pose.name, np.dstack([noise(camera), cover]))
    (view,) = truth.render_truth({"agent": "replay"}, pool, tmp_path)
    assert (
        vars(view.camera).keys() == vars(scoring_camera(camera)).keys() and view.camera.fx == scoring_camera(camera).fx
    )
    assert view.image.shape == (scoring_camera(camera).height, 96, 3) == (*view.weight.shape, 3)
    np.testing.assert_allclose(
        view.image, image_files.shrink_image(noise(camera), 96, scoring_camera(camera).height), atol=0.5 / 255
    )
    middle = scoring_camera(camera).height // 2
    assert (view.weight[: middle - 1] == 0).all() and (view.weight[middle + 1 :] == 1).all()


def test_truth_is_not_known_where_photos_must_be_asked_for(tmp_path):
    with pytest.raises(InputError, match="handheld"):
        list(truth.render_truth({"agent": "handheld"}, candidates(64, 64), tmp_path))
    with pytest.raises(InputError, match=r"p0\.png"):
        list(truth.render_truth({"agent": "replay"}, candidates(128, 96), tmp_path))


def test_few_candidates_are_spread_and_always_the_same():
    pool = candidates(8, 8, count=12)
    chosen = [pose.name for pose, _ in truth.spread_candidates(pool, 4)]
    assert chosen[:2] == ["p0.png", "p6.png"] and set(chosen[2:]) == {"p3.png", "p9.png"}
    assert truth.spread_candidates(pool, 50) != [] and {p.name for p, _ in truth.spread_candidates(pool, 50)} == {
        p.name for p, _ in pool
    }
    assert truth.spread_candidates([], 3) == []
