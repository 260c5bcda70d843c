"""One Gaussian on the screen against the EWA formula in numpy, with the library's camera."""

import json

import numpy as np
import pytest
from fixtures import bundles
from fixtures.browser import served
from scipy.spatial.transform import Rotation

from dav_gswt.bundle import store
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.field import GaussianField
from dav_gswt.geometry import cameras

AT, DEVIATION, PAINT = np.array([3.0, 1.0, 0.1]), np.array([0.3, 0.05, 0.02]), np.array([230, 40, 90, 200])
TURN = np.array([0.96, 0.05, -0.09, 0.26])  # any quaternion
BACK = np.array([0.5, 0.75, 0.25])


def one(ground, tile, level):
    row = np.zeros(1, bundles.LOOK)
    row["position"], row["deviation"], row["paint"], row["turn"] = AT, DEVIATION, PAINT, TURN
    return row


@pytest.fixture(scope="module")
def seen_as(lonely_folder):
    """The Gaussian as it was rounded."""
    return store.Bundle(
        lonely_folder, Manifest.from_dict(json.loads((lonely_folder / "davgswt.json").read_text()))
    ).chunk(0, 0)


@pytest.fixture(scope="module")
def lonely_folder(page_of):
    """A page with one turned, drawn-out Gaussian a tile of 40 units before one plain colour."""
    plain = {"ground_colour": BACK.tolist(), "sky": {"zenith": BACK.tolist(), "horizon": BACK.tolist()}}
    ground = bundles.Ground(side=40.0, levels=1, eye_floor=0.5)
    return page_of(ground, one, edit=lambda manifest: manifest.update(plain))


@pytest.fixture(scope="module")
def lonely(lonely_folder):
    with served(lonely_folder) as address:
        yield address


def expected(camera: cameras.Camera, field: GaussianField) -> np.ndarray:
    """The picture of the one Gaussian: J W S W^T J^T + 0.3 px^2, cut below 1/255."""
    at = field.means[0].astype(float)
    axes = Rotation.from_quat(field.quats[0].astype(float), scalar_first=True).as_matrix()
    q = camera.rotation @ at + camera.translation
    jacobian = camera.fx / q[2] * np.array([[1, 0, -q[0] / q[2]], [0, 1, -q[1] / q[2]]])
    spread = jacobian @ camera.rotation @ axes * np.exp(field.log_scales[0].astype(float))
    inverse = np.linalg.inv(spread @ spread.T + 0.3 * np.eye(2))
    centre = camera.project(at[None])[0][0]
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    d = np.stack([u, v], -1) - centre
    alpha = PAINT[3] / 255 * np.exp(-0.5 * np.einsum("hwi,ij,hwj->hw", d, inverse, d))
    alpha = np.where(alpha < 1 / 255, 0, alpha)[..., None]
    return 255 * (BACK + alpha * (PAINT[:3] / 255 - BACK))


@pytest.mark.parametrize(
    "place",
    [
        pytest.param(dict(x=3.0, y=1.0, eye=4.0, yaw=90.0, pitch=-90.0), id="from above"),
        pytest.param(dict(x=2.0, y=-1.0, eye=30.0, yaw=60.0, pitch=-85.0), id="thinner than a pixel"),
        pytest.param(dict(x=2.0, y=-0.5, eye=2.0, yaw=75.0, pitch=-40.0), id="from the south"),
        pytest.param(dict(x=4.0, y=1.6, eye=0.8, yaw=205.0, pitch=-38.0), id="low, from the north-east"),
    ],
)
def test_a_gaussian_looks_as_the_formula_says(still, lonely, seen_as, place):
    seen = still(lonely).at(**place)
    yaw, pitch = np.radians(place["yaw"]), np.radians(place["pitch"])
    eye = np.array([place["x"], place["y"], place["eye"]])
    ahead = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    formula = expected(cameras.pinhole(eye, eye + ahead, 320, 200, 60.0), seen_as)
    assert np.abs(formula - 255 * BACK).max() > 60, "the Gaussian is in the picture"
    # rounding to 8 bits: half a step for the back, half for the sum; one more where the rim is cut at 1/255
    assert np.abs(seen - formula).max() <= 2.01
