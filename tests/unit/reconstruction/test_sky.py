import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.geometry import cameras
from dav_gswt.photos.training_views import TrainingView
from dav_gswt.raster import render
from dav_gswt.reconstruction import sky
from dav_gswt.reconstruction.objects import make_blobs
from dav_gswt.reconstruction.observation import mask_to_ground

THING = np.array([[1.6, 1.6, 0.35]])


def heavens(directions):
    """Bright at the horizon and towards the east."""
    up, east = directions[..., 2], directions[..., 0]
    return np.stack([0.55 + 0.1 * east - 0.2 * up, 0.65 - 0.1 * up, 0.9 + 0 * up], -1).astype(np.float32)


def floating(logit):
    """The made-up ground and a dark thing over it."""
    return concatenate_fields([made.field(), make_blobs(THING, np.full((1, 3), 0.05), np.full(1, 0.08), logit=logit)])


def low(count=4, size=48, thing=True):
    """Photos of the made-up ground from low down, under the made-up sky, with a dark thing that stands against it."""
    found, field = [], floating(5.0) if thing else made.field()
    for i in range(count):
        angle = 2 * np.pi * i / count + 0.3
        eye = [1.6 + 1.3 * np.cos(angle), 1.6 + 1.3 * np.sin(angle), 0.3]
        camera = cameras.pinhole(eye, [1.6, 1.6, 0.4], size, size, 60.0)
        _, step = camera.rays()
        directions = step / np.linalg.norm(step, axis=-1, keepdims=True)
        seen = render(field, camera)
        image = np.clip(seen.colour + (1 - seen.alpha)[..., None] * heavens(directions), 0, 1).astype(np.float32)
        found.append(TrainingView(f"low_{i}", camera, image, np.ones((size, size), np.float32)))
    return found


@pytest.mark.slow
def test_the_sky_has_the_same_bits_whatever_the_threads_of_blas(root):
    code = """if True:
        import numpy as np
        from dav_gswt.reconstruction import sky
        rng = np.random.default_rng(1)
        directions = rng.normal(size=(100_003, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        coefficients, deviation = sky.fit_sky(directions, rng.uniform(0, 1, (100_003, 3)).astype(np.float32))
        print(*(value.hex() for value in (*coefficients.ravel().tolist(), deviation)))
    """
    found = []
    for threads in ("1", "2", "4"):  # which BLAS reads when it is loaded
        environment = os.environ | {"OPENBLAS_NUM_THREADS": threads, "PYTHONPATH": str(root / "workflow/lib")}
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        found.append(done.stdout)
    assert len(found[0].split()) == 49 and len(set(found)) == 1


def test_sky_counts_and_what_stands_against_it_says_nothing():
    photos = low()
    found = sky.add_sky(photos, mask_to_ground(photos, made.grid()))
    for view, photo, ground in zip(found, photos, mask_to_ground(photos, made.grid()), strict=True):
        _, step = photo.camera.rays()
        rising = step[..., 2] > 0
        np.testing.assert_array_equal(sky._pixels_above_horizon(photo), rising)
        known = ~np.isnan(view.behind[..., 0])
        assert known[rising].mean() > 0.8 and not known[~rising].any()
        dark = rising & (photo.image.max(-1) < 0.3)
        assert dark.any() and not known[dark].any() and not view.weight[dark].any()
        np.testing.assert_array_equal(view.weight[~rising], ground.weight[~rising])
        np.testing.assert_allclose(view.behind[known], photo.image[known], atol=0.06)


def test_photos_from_above_and_broken_skies_have_none():
    rng = np.random.default_rng(1)
    broken = [replace(v, image=rng.uniform(0, 1, v.image.shape).astype(np.float32)) for v in low()]
    for photos in (made.photos(), broken):
        assert all(v.behind is None for v in sky.add_sky(photos, mask_to_ground(photos, made.grid())))
