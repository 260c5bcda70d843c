"""Positions by GPS and the choice of a focal length, against made-up flights."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.photos.colmap_model import (
    intersect_rays,
    transform_model,
    triangulate_model,
    write_colmap_model,
)
from dav_gswt.photos.sfm import gps
from dav_gswt.photos.sfm.mapping import OBLIQUE, settle_focal_length
from dav_gswt.photos.sfm.registration import require_parallax

HEIGHT = 40.0  # metres: a flying height


@pytest.fixture
def reconstruct(tmp_path):
    """Makes a reconstruction of a model, whose cameras share one lens of a focal length."""

    def make(model, focal=synth.FOCAL):
        write_colmap_model(triangulate_model(model, model.names), tmp_path)  # points that two photos see
        out = pycolmap.Reconstruction(str(tmp_path))
        out.cameras[1].model = pycolmap.CameraModelId.SIMPLE_RADIAL
        out.cameras[1].params = [focal, synth.WIDTH / 2, synth.HEIGHT / 2, 0.0]
        return out

    return make


def place(model, rng, noise):
    """GPS positions of the model's cameras, turned by 30 degrees about the vertical."""
    c, s = np.cos(0.5), np.sin(0.5)
    true = HEIGHT * np.array([camera.centre for camera in model.cameras]) @ [[c, s, 0], [-s, c, 0], [0, 0, 1]]
    return dict(zip(model.names, true + rng.normal(0, noise, true.shape), strict=True))


def test_photos_along_a_line_or_at_one_place_are_not_placed(reconstruct):
    """Ten photos on 90 metres, receivers 2 metres off: about the line the positions say nothing."""
    rng = np.random.default_rng(0)
    model = synth.model(synth.flight(1, 10, step=0.25), synth.plain(500, 1.0, rng))
    best = reconstruct(model)
    for at in (place(model, rng, 2.0), {name: rng.normal(0, 1.0, 3) for name in model.names}):
        assert not gps.align_to_gps(best, at)
        assert best.images[1].projection_center() == pytest.approx(model.cameras[0].centre)


def test_positions_over_an_area_place_the_photos_and_outliers_have_no_say(reconstruct):
    rng = np.random.default_rng(2)
    model = synth.model(synth.flight(3, 4, step=0.4), synth.plain(500, 1.0, rng, relief=0.02))
    best, at, true = reconstruct(model), place(model, rng, 0.5), place(model, rng, 0.0)
    at[model.names[5]] += [60.0, -80.0, 0.0]
    assert gps.align_to_gps(best, at)
    off = [best.images[i].projection_center() - true[best.images[i].name] for i in best.reg_image_ids()]
    assert np.abs(off).max() < 1.5
    wild = {name: rng.normal(0, 60, 3) for name in model.names}
    assert not gps.align_to_gps(best, wild)
    assert not gps.align_to_gps(best, dict.fromkeys(model.names, np.full(3, np.nan)))


def test_without_altitudes_the_model_gives_them_and_the_rest_stays_exact(reconstruct):
    """A world upside down, so that up is found and not given; heights count from the ground."""
    rng = np.random.default_rng(2)
    model = synth.model(synth.flight(3, 4, step=0.4), synth.plain(500, 1.0, rng, relief=0.01))
    true = place(model, rng, 0.0)
    best = reconstruct(transform_model(model, 0.3, np.diag([1.0, -1.0, -1.0]), np.array([4.0, 5.0, 6.0])))
    assert gps.align_to_gps(best, {name: at * [1, 1, np.nan] for name, at in true.items()})
    off = [best.images[i].projection_center() - true[best.images[i].name] for i in best.reg_image_ids()]
    assert np.abs(off).max() < 0.5  # metres, of 40: the plane of rough ground lies a hundredth off


def test_positions_count_where_most_photos_have_one_and_they_spread(monkeypatch):
    """Photos 0.001 degrees of latitude apart, which are 111 metres."""
    places = {f"{i}": (48.0 + 0.001 * i, 11.0, 500.0) for i in range(5)}
    monkeypatch.setattr(gps, "read_gps_position", lambda path: places.get(path.name))
    found = gps.read_gps_positions([Path(str(i)) for i in range(6)])
    assert (found.about.latitude, found.about.longitude, found.about.altitude) == (48.002, 11.0, 500.0)
    assert found.at[:5, 1] == pytest.approx(111.2 * np.arange(-2, 3), rel=0.01) and np.isnan(found.at[5]).all()
    assert gps.read_gps_positions([Path(str(i)) for i in range(7)]) is None  # two of seven have none
    assert gps.read_gps_positions([Path("none")]) is None
    monkeypatch.setattr(gps, "read_gps_position", lambda path: (48.0 + 1e-5 * int(path.name), 11.0, 500.0))
    assert gps.read_gps_positions([Path(str(i)) for i in range(6)]) is None  # within 6 metres


def oblique(count=9):
    """Photos from the side, which fix the focal length, over ground with relief."""
    cameras = [
        synth.camera((0.75 * np.cos(a), 0.75 * np.sin(a), 0.8 + 0.1 * (i % 2)), (0.02 * i, 0, 0))
        for i, a in enumerate(np.linspace(-0.6, 0.6, count))
    ]
    return synth.model(cameras, synth.plain(300, 0.6, np.random.default_rng(0), relief=0.03))


def settle(best, held, hold=False):
    return settle_focal_length(best, held, np.random.default_rng(0), hold)


def test_oblique_views_fix_a_focal_length_that_exif_has_wrong(reconstruct):
    best = reconstruct(oblique(), 1.08 * synth.FOCAL)
    best, found = settle(best, {1: 1.08 * synth.FOCAL})
    assert "from the side" in found.decision and found.tilt > OBLIQUE
    assert found.used == found.free == best.cameras[1].focal_length == pytest.approx(synth.FOCAL, rel=1e-3)
    assert found.exif == pytest.approx(1.08 * synth.FOCAL)
    assert best.compute_mean_reprojection_error() < 0.01  # points and poses went with it


def test_a_focal_length_that_shall_be_held_or_that_views_from_above_leave_open_stays(reconstruct):
    above = synth.model(synth.flight(3, 3), synth.plain(300, 0.7, np.random.default_rng(0), relief=0.02))
    for model, hold, said in ((oblique(), True, "held"), (above, False, "EXIF's")):
        best = reconstruct(model, 1.08 * synth.FOCAL)
        before = best.images[1].cam_from_world().matrix()
        best, found = settle(best, {1: 1.08 * synth.FOCAL}, hold)
        assert said in found.decision and found.used == best.cameras[1].focal_length == 1.08 * synth.FOCAL
        assert np.array_equal(best.images[1].cam_from_world().matrix(), before)
    assert "confirm" in settle(reconstruct(model), {1: synth.FOCAL})[1].decision


def test_without_exif_the_photos_alone_say_the_focal_length(reconstruct):
    _, found = settle(reconstruct(oblique()), {})
    assert found.exif is found.free is None and found.used == synth.FOCAL and "straight down" not in found.decision
    with pytest.raises(InputError, match="0.30 picture widths"):
        settle(reconstruct(oblique(), 0.3 * synth.WIDTH), {})


def test_photos_from_one_spot_are_refused():
    for step, fits in ((0.2, True), (0.005, False)):
        model = synth.model(synth.flight(2, 2, step), synth.plain(50, 0.3, np.random.default_rng(0)))
        _, spread = intersect_rays(model)
        if fits:
            require_parallax(spread)
        else:
            with pytest.raises(InputError, match="one spot"):
                require_parallax(spread)
