"""Of the Gaussians about the eye the worker sorts only those that may show: never one too few, and few too many."""

import numpy as np
import pytest

from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.geometry import cameras
from dav_gswt.terrain import stills
from dav_gswt.terrain.heights import displace_means, surface_from_config

SIDE, COUNT, NEAR = 4.0, 1000, 0.05
DEVIATIONS = np.geomspace(0.005, 0.5, 16)
SURFACES = {"flat": {"kind": "flat"}, "hills": {"kind": "hills", "height": 1.0, "wavelength": 3.0}}
LOOK = """async ({ surface, side, near, deviations, centres, sizes, cameras }) => {
  const { createNearSorter } = await import("./worker/near_sort.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { height = 0, wavelength = 1 } = surface; // in tile sides
  const heights = createHeights({ ...surface, height: height * side, wavelength: wavelength * side });
  const count = sizes.length, cell = { di: 0, dj: 0, tiles: [0], border: null, lo: 0, hi: 0, whole: true, count };
  const entries = Uint32Array.from({ length: count }, (_, k) => k);
  const chunk = { centres: new Float32Array(centres), sizes: new Uint8Array(sizes), entries, count };
  const sortNear = createNearSorter({ get: () => chunk }, { side, near, deviations, heights }, null);
  const RANGE = { switches: [Infinity], bands: [0] };
  return cameras.map(camera => Array.from(sortNear([cell], camera, RANGE), entry => entry & 0x3fffff));
}"""


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.fixture
def field(rng) -> GaussianField:
    """Gaussians of any size and turn, strewn over a tile."""
    which = rng.integers(0, len(DEVIATIONS), (COUNT, 3))
    means = rng.uniform([0, 0, -0.1], [SIDE, SIDE, 0.8], (COUNT, 3)).astype(np.float32)
    return GaussianField(
        means,
        np.log(DEVIATIONS[which]).astype(np.float32),
        rng.normal(size=(COUNT, 4)).astype(np.float32),
        np.full(COUNT, 6.0, np.float32),
        rgb_to_sh(rng.uniform(size=(COUNT, 3))),
        np.zeros(COUNT, np.float32),
        np.zeros(COUNT, bool),
    )


def looks(surface, rng) -> list[tuple[np.ndarray, cameras.Camera]]:
    """Where the eye is in the tile, and the camera about it, its eye at 0."""
    found = []
    for width, height, degrees in [(320, 200, 60.0), (90, 400, 30.0), (640, 200, 100.0)] * 4:
        x, y = rng.uniform(0.1 * SIDE, 0.9 * SIDE, 2)
        (ground,), _ = surface.at(np.array([x]), np.array([y]))
        yaw, pitch = rng.uniform(0, 2 * np.pi), rng.uniform(-1.4, 0.4)
        ahead = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
        eye = np.array([x, y, ground + rng.uniform(0.3, 2.0)])
        found.append((eye, cameras.pinhole(np.zeros(3), ahead, width, height, degrees)))
    return found


@pytest.mark.parametrize("entry", SURFACES.values(), ids=SURFACES)
def test_whatever_may_show_is_sorted(modules, field, rng, entry):
    surface = surface_from_config(entry, SIDE, 1.0)
    views = looks(surface, rng)
    given = {
        "surface": {"octaves": 4, "salt": 0} | entry,
        "side": SIDE,
        "near": NEAR,
        "deviations": DEVIATIONS.tolist(),
        "centres": field.means.ravel().tolist(),
        "sizes": np.abs(field.log_scales.max(1)[:, None] - np.log(DEVIATIONS)).argmin(1).tolist(),
        "cameras": [_of_page(eye, camera) for eye, camera in views],
    }
    sorted_ = modules.evaluate(LOOK, given)
    shown = kept = 0
    for (eye, camera), found in zip(views, sorted_, strict=True):
        placed, slope = displace_means(field, surface, np.zeros(3), eye)
        _, which = stills.project(placed, slope, camera, NEAR)
        assert set(which.tolist()) <= set(found)
        depth = placed.means @ camera.rotation[2]
        assert (np.diff(depth[found]) <= 1e-4).all(), "back to front"
        shown, kept = shown + len(which), kept + len(found)
    assert shown > 0 and kept < 0.8 * COUNT * len(views), "what is behind or beside is left out"


def _of_page(eye, camera) -> dict:
    right, down, ahead = camera.rotation.tolist()
    up = [-v for v in down]
    size = {"focal": camera.fx, "width": camera.width, "height": camera.height}
    return {"eye": eye.tolist(), "right": right, "up": up, "ahead": ahead} | size
