"""Steps on a GPU are those without one: through a gsplat that is made up, and on a real GPU where there is one."""

import importlib
import sys

import numpy as np
import pytest
from fixtures import fake_gsplat
from fixtures import ground as made

from dav_gswt.field import concatenate_fields
from dav_gswt.raster import backends
from dav_gswt.reconstruction.fitting import trainer
from dav_gswt.reconstruction.fitting.plan import FitPlan
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs

MODULES = "dav_gswt.raster.cuda", "dav_gswt.reconstruction.fitting.device_descent"


@pytest.fixture(params=["made up", "GPU"])
def on_device(request, monkeypatch):
    """Have fits take their steps through gsplat; whether it is real."""
    if request.param == "GPU" and (why := backends.explain_unavailable("cuda")):
        pytest.skip(why)
    monkeypatch.setenv(backends.VARIABLE, "cpu")  # what is compared with
    if request.param == "made up":
        monkeypatch.setitem(sys.modules, "gsplat", fake_gsplat)
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name, raising=False)
    cuda, device_descent = map(importlib.import_module, MODULES)
    drawn = cuda.Rasterizer(device="cpu" if request.param == "made up" else "cuda")

    def use():
        monkeypatch.setattr(trainer, "_choose_descent", lambda task: device_descent.DeviceDescent(drawn))

    yield use
    for name in MODULES:
        sys.modules.pop(name, None)


def fit(plan: FitPlan):
    """A field of ground, two things and one that is nearly transparent, fitted to photos that are too bright."""
    things = make_blobs(np.array([[1.2, 1.6, 0.2], [2.0, 1.6, 0.2]]), np.full((2, 3), 0.5), np.full(2, 0.08))
    loose = make_blobs(np.array([[1.6, 2.0, 0.2]]), np.full((1, 3), 0.5), np.full(1, 0.08), logit=-6.0)
    start = concatenate_fields([made.field(), things, loose])
    photos = [view.with_pixels(image=1.1 * view.image) for view in made.photos(size=24)]
    constraints = GroundConstraints(made.grid(), np.full(made.grid().shape, 0.5))
    return trainer.fit_field(start, photos, plan, constraints, np.random.default_rng(3))


@pytest.mark.parametrize("plan", [FitPlan(4, 1), FitPlan(4, 1, sh_degree=1)], ids=["plain", "with harmonics"])
def test_a_fit_ends_as_without_a_gpu(on_device, plan):
    wanted = fit(plan)
    on_device()
    found = fit(plan)
    assert len(found.field) == len(wanted.field)
    moved = np.abs(wanted.field.means - fit(FitPlan(0, 1)).field.means).max(1)
    assert (moved > 1e-3).sum() > 100
    for parameter, value in vars(wanted.field).items():
        apart = np.abs(np.asarray(getattr(found.field, parameter), float) - np.asarray(value, float))
        # of a gradient that is nearly zero Adam makes a full step, which way is a matter of roundings
        assert np.quantile(apart, 0.75) < 1e-4, parameter


def test_growth_adds_as_many_as_without_a_gpu(on_device):
    plan = FitPlan(6, len(made.field()) + 40)
    wanted = fit(plan)
    on_device()
    found = fit(plan)
    assert len(found.field) > len(made.field()) + 10
    assert abs(len(found.field) - len(wanted.field)) <= 4
