"""Steps on a GPU are those without one, and nothing in them waits for the host.

Through a gsplat that is made up, on PyTorch's CPU and on its device without values; and on a GPU where there is one.
"""

import importlib
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from fixtures import fake_gsplat
from fixtures import ground as made
from fixtures.no_reads import no_reads

from dav_gswt import raster
from dav_gswt.field import concatenate_fields
from dav_gswt.raster import backends
from dav_gswt.reconstruction.fitting import exposure, state, trainer
from dav_gswt.reconstruction.fitting.descent import Descent, TrainingState, TrainingTask
from dav_gswt.reconstruction.fitting.plan import FitPlan, Schedule
from dav_gswt.reconstruction.ground_constraints import GroundConstraints
from dav_gswt.reconstruction.objects import make_blobs

MODULES = "dav_gswt.raster.cuda", "dav_gswt.reconstruction.fitting.device_descent"
SIDE = 24  # pixels of a photo
GRID = made.grid(0.2, 16)
PLANS = {"plain": FitPlan(12, 1), "with harmonics": FitPlan(12, 1, sh_degree=2)}
GROWING = FitPlan(100, 10**4)  # grows every 7 steps: in each before, errors are gathered


@pytest.fixture(params=["made up", "GPU"])
def device(request, monkeypatch):
    """The modules of steps on a device, and its name."""
    real = request.param == "GPU"
    if real and (why := backends.explain_unavailable("cuda")):
        pytest.skip(why)
    monkeypatch.setenv(backends.VARIABLE, "cpu")  # what is compared with
    if not real:
        monkeypatch.setitem(sys.modules, "gsplat", fake_gsplat)
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name, raising=False)
    cuda, descent = map(importlib.import_module, MODULES)
    name = "cuda" if real else "cpu"

    def make(on=name):
        return descent.DeviceDescent(cuda.Rasterizer(device=on))

    yield SimpleNamespace(name=name, module=descent, make=make)
    for name in MODULES:
        sys.modules.pop(name, None)


def constrain():
    return GroundConstraints(GRID, np.full(GRID.shape, 0.5))


def begin(device, plan, loose=False, descent=None):
    """A fit of ground and two things before its first step, to photos that show all of it, too bright, one with some
    sky, of values that bytes can say. loose: the things are nearly transparent."""
    logit = -6.0 if loose else 1.0
    things = make_blobs(np.array([[1.2, 1.6, 0.2], [2.0, 1.6, 0.2]]), np.full((2, 3), 0.5), np.full(2, 0.08), logit)
    things.log_scales[:, 1:] -= [0.2, 0.5]
    start = concatenate_fields([made.field(GRID), things])

    def pack(values):
        return device.module.pack_image(values, torch.device("cpu")).unpack().numpy()

    views = [view.with_pixels(image=pack(1.1 * view.image)) for view in made.photos(3, SIDE, GRID, fov=75.0)]
    sky = np.full((SIDE, SIDE, 3), np.nan, np.float32)
    sky[:4] = 0.5
    views[0] = views[0].with_pixels(behind=pack(sky))
    run = TrainingState(state.from_field(start), np.random.default_rng(3), exposure.ExposureTracker(len(views)))
    task = TrainingTask(views, plan, Schedule(plan, len(start)), constrain(), raster.make_rasterizer())
    descent = descent or device.make()
    descent.start(run, task)
    return run, task, descent


@pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)
def test_steps_are_those_of_the_core(device, plan):
    near, off = (1e-3, 0.1) if device.name == "cuda" else (1e-4, 1e-3)  # gsplat's roundings: see raster/cuda.py
    wanted, found = begin(device, plan, descent=Descent()), begin(device, plan)
    before = wanted[0].state.convert(np.copy).values
    for _ in range(plan.steps):
        trainer._advance(*wanted)
        trainer._advance(*found)
        assert float(found[0].loss) == pytest.approx(wanted[0].loss, rel=near)
    assert found[0].exposures.gains.tolist() == pytest.approx(wanted[0].exposures.gains, abs=near)
    for name, value in wanted[0].state.values.items():
        moved = np.abs(value[:, :1] - before[name] if value.ndim == 3 else value - before[name])
        apart = np.abs(found[0].state.values[name].cpu().numpy() - value)
        # of a gradient that is nearly zero Adam makes a full step, which way is a matter of roundings
        assert moved.max() > 0.05 and np.quantile(apart, 0.9) < off * moved.max(), name


@pytest.mark.parametrize("plan", [*PLANS.values(), GROWING], ids=[*PLANS, "before growth"])
@pytest.mark.parametrize("valued", [True, False], ids=["", "without values"])
def test_a_step_neither_reads_nor_copies_and_no_shape_depends_on_a_value(device, monkeypatch, plan, valued):
    if device.name == "cuda":
        pytest.skip("gsplat reads how long its list of tiles is")
    if not valued:
        monkeypatch.setattr(torch, "Generator", lambda device: SimpleNamespace(manual_seed=lambda seed: None))
    run, task, descent = begin(device, plan, loose=True, descent=None if valued else device.make("meta"))
    before = run.state.values["means"]
    with no_reads():
        for _ in range(min(plan.steps, 6 if plan is GROWING else 12)):
            trainer._advance(run, task, descent)
    assert run.state.sh_degree == plan.sh_degree and (run.errors is not None) == (plan is GROWING)
    assert run.state.values["means"].shape == before.shape and run.loss.shape == ()
    if valued:
        assert np.isfinite(float(run.loss)) and descent.check(run) is None


def test_a_whole_fit_grows_and_prunes_as_without_a_gpu(device, monkeypatch):
    field = made.field(GRID)
    plan = FitPlan(30, len(field) + 40)
    fitted = []
    for choose in (lambda task: Descent(), lambda task: device.make()):
        monkeypatch.setattr(trainer, "_choose_descent", choose)
        seen = []
        options = trainer.FitOptions(callback=lambda step, now, seen=seen: seen.append(now), every=10)
        fit = trainer.fit_field(field, made.photos(3, SIDE), plan, constrain(), np.random.default_rng(3), options)
        assert len(seen) == 3 and isinstance(seen[1].values["means"], np.ndarray)
        fitted.append(fit.field)
    assert len(fitted[1]) > len(field) + 10 and abs(len(fitted[1]) - len(fitted[0])) <= 8
    assert type(fitted[1].means) is np.ndarray


def test_values_that_are_no_longer_finite_end_a_fit_with_their_gaussian(device):
    run, task, descent = begin(device, PLANS["plain"])
    trainer._advance(run, task, descent)
    descent.check(run)
    run.state.values["log_scales"][7, 1] = torch.nan
    with pytest.raises(ValueError, match="log_scales of Gaussian 7 is not finite"):
        descent.check(run)
