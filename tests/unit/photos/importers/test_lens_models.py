"""Lenses of other programs: their own formulas against the cameras that stand for them, and what no lens can be."""

from dataclasses import replace

import numpy as np
import pycolmap
import pytest
from fixtures import photos as synth

from dav_gswt.errors import InputError
from dav_gswt.photos.importers import lens_models, nerfstudio, opensfm
from dav_gswt.photos.importers.lens_models import (
    fit_camera_to_photo,
    require_invertible,
)
from dav_gswt.photos.lenses import make_camera

W, H = 400, 300
RNG = np.random.default_rng(11)
RAYS = np.c_[RNG.uniform(-0.6, 0.6, (200, 2)), np.ones(200)] * RNG.uniform(0.5, 3, (200, 1))


def brown(rays, fx, fy, cx, cy, k, p):
    """OpenCV's definition (calib3d, "Detailed Description"); OpenSfM's and nerfstudio's are the same one."""
    x, y = (rays[:, :2] / rays[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + sum(c * r2 ** (i + 1) for i, c in enumerate(k))
    u = x * radial + 2 * p[0] * x * y + p[1] * (r2 + 2 * x * x)
    v = y * radial + p[0] * (r2 + 2 * y * y) + 2 * p[1] * x * y
    return np.c_[fx * u + cx, fy * v + cy]


def bent(rays, fx, fy, cx, cy, k):
    """A fisheye after OpenCV (calib3d, fisheye) and OpenSfM (FisheyeProjection): by the angle off the axis."""
    r = np.hypot(rays[:, 0], rays[:, 1])
    angle = np.arctan2(r, rays[:, 2])
    out = angle * (1 + sum(c * angle ** (2 * i + 2) for i, c in enumerate(k)))
    return np.c_[fx * out * rays[:, 0] / r + cx, fy * out * rays[:, 1] / r + cy]


K, P = (-0.11, 0.03, 0.004, -0.002), (0.0013, -0.0008)
ONE, TWO = {"focal": 0.8}, {"focal_x": 0.8, "focal_y": 0.81, "c_x": 0.011, "c_y": -0.007}
NAMED = {f"k{i + 1}": v for i, v in enumerate(K)} | {"p1": P[0], "p2": P[1]}


@pytest.mark.parametrize(
    "kind, focal, terms, formula",
    [
        ("perspective", ONE, 2, lambda *a: brown(*a, K[:2], (0, 0))),
        ("brown", TWO, 3, lambda *a: brown(*a, K[:3], P)),
        ("simple_radial", TWO, 1, lambda *a: brown(*a, K[:1], (0, 0))),
        ("fisheye", ONE, 2, lambda *a: bent(*a, K[:2])),
        ("fisheye_opencv", TWO, 4, lambda *a: bent(*a, K)),
    ],
)
def test_opensfm_cameras_project_as_its_own_formula_says(kind, focal, terms, formula):
    used = {
        k: v for k, v in NAMED.items() if k in [f"k{i + 1}" for i in range(terms)] or kind == "brown" and k[0] == "p"
    }
    found = opensfm._make_lens({"projection_type": kind, "width": W, "height": H} | focal | used, "there")
    fx = focal.get("focal_x", 0.8) * W
    fy = focal.get("focal_y", 0.8) * W
    cx, cy = W / 2 + W * focal.get("c_x", 0), H / 2 + W * focal.get("c_y", 0)  # lengths in longer sides, both
    assert found.img_from_cam(RAYS) == pytest.approx(formula(RAYS, fx, fy, cx, cy), abs=1e-9)


@pytest.mark.parametrize("said", [{"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}])
def test_a_fisheye_of_nerfstudio_projects_as_its_own_formula_says(said):
    said |= {"w": W, "h": H, "fl_x": 320.0, "fl_y": 322.0, "cx": 203.0, "cy": 148.0}
    said |= {f"k{i + 1}": term for i, term in enumerate(K)}
    found = nerfstudio._make_lens(nerfstudio._read_intrinsics(said, {}, "there"), "there")
    assert found.img_from_cam(RAYS) == pytest.approx(bent(RAYS, 320.0, 322.0, 203.0, 148.0, K), abs=1e-9)


MODELS = [n for n in pycolmap.CameraModelId.__members__ if n not in ("INVALID", "EQUIRECTANGULAR")]


@pytest.mark.parametrize("name", MODELS)
def test_a_turned_lens_sees_turned_rays_at_turned_places(name):
    """Every model of COLMAP's: clockwise once, (x, y) is at (height - y, x)."""
    plain = pycolmap.Camera.create_from_model_name(1, name, 320.0, W, H)
    params = plain.params.copy()
    small = RNG.uniform(-0.03, 0.03, len(params))
    for i in plain.extra_params_idxs():
        params[i] += small[i] if name not in ("FOV", "EUCM") else abs(small[i])
    for i in plain.principal_point_idxs():
        params[i] += 100 * small[i]
    if len(plain.focal_length_idxs()) == 2:
        params[plain.focal_length_idxs()[1]] += 4
    plain.params = params
    for turns, orientation in ((1, 6), (2, 3), (3, 8)):
        turned, count = fit_camera_to_photo(plain, (W, H), orientation, "there")
        at = np.asarray(plain.img_from_cam(RAYS))
        size = np.array([W, H])
        for _ in range(turns):
            at, size = np.c_[size[1] - at[:, 1], at[:, 0]], size[::-1]
        rays = RAYS @ np.linalg.matrix_power(lens_models.QUARTER, turns).T
        assert count == turns and (turned.width, turned.height) == tuple(size)
        assert turned.img_from_cam(np.ascontiguousarray(rays)) == pytest.approx(at, abs=1e-9)


def test_a_lens_that_fits_the_upright_photo_alone_is_not_turned_and_mirrored_photos_are_refused():
    camera = make_camera("PINHOLE", H, W, (320.0, 320.0, H / 2, W / 2), "")
    same, turns = fit_camera_to_photo(camera, (W, H), 6, "there")
    assert turns == 0 and (same.width, same.height) == (H, W)
    with pytest.raises(InputError, match="there: its EXIF orientation mirrors"):
        fit_camera_to_photo(make_camera("PINHOLE", W, H, (320.0, 320.0, 200.0, 150.0), ""), (W, H), 2, "there")


def test_a_distortion_that_folds_over_is_refused():
    flat = replace(synth.camera((0, 0, 1)), fx=200.0, fy=200.0, cx=200.0, cy=150.0, width=W, height=H)
    require_invertible(make_camera("OPENCV", W, H, (200.0, 200.0, 200.0, 150.0, -0.05, 0.0, 0.0, 0.0), ""), flat, "")
    for terms in ((-3.0, 5.0, 1.0, 1.0), (-1.2, 0.0, 0.0, 0.0), (1e30, 0.0, 0.0, 0.0)):
        camera = make_camera("OPENCV", W, H, (200.0, 200.0, 200.0, 150.0, *terms), "")
        with pytest.raises(InputError, match="there: the distortion of its camera cannot be undone"):
            require_invertible(camera, flat, "there")
