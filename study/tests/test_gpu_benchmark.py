"""The script that measures a GPU, at tiny sizes without one: it is ready when there is one."""

import sys

import numpy as np
import pytest
from fixtures import fake_gsplat
from fixtures import ground as made

from dav_gswt.photos.colmap_model import ColmapModel
from dav_gswt.raster import backends
from dav_gswt.reconstruction.fitting.plan import FitSettings

TINY = FitSettings(fit_size=48, spacing=1.0, max_gaussians=3000, steps=25)


@pytest.fixture
def gpu(root, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(root / folder) for folder in ("study/benchmarks", "benchmarks")] + sys.path)
    monkeypatch.setenv(backends.VARIABLE, "cpu")
    import gpu as script

    yield script
    for name in ("gpu", "raster", "record"):
        sys.modules.pop(name, None)


def test_a_step_is_measured_against_its_kernels(gpu, monkeypatch):
    monkeypatch.setitem(sys.modules, "gsplat", fake_gsplat)
    modules = "dav_gswt.raster.cuda", "dav_gswt.reconstruction.fitting.device_descent"
    for name in modules:
        monkeypatch.delitem(sys.modules, name, raising=False)
    found = gpu.measure_step("cpu", cells=8, free=60, size=(20, 16), steps=4)
    for name in modules:
        sys.modules.pop(name, None)
    assert found["gaussians"] == 64 + 16 + 60 and found["step_ms"] > 0
    assert found["step_over_kernels"] == pytest.approx(found["step_ms"] / found["kernels_ms"])


def test_fits_and_what_precedes_them_are_measured(gpu):
    from dav_gswt_study.fit_profile import PhotoSet

    views, points = made.photos(5), made.grid().centres[::7]
    none = np.zeros(0, int)
    colours = made.look(*points[:, :2].T).astype(np.float32)
    model = ColmapModel((), (), points, colours, none, none, np.zeros((0, 2)))
    photos = PhotoSet(made.FRAME, model, views[1:], views[:1])
    fit, start = gpu.measure_fit(photos, TINY), gpu.measure_start(photos, TINY)
    assert len(fit["curves"]["ours"]) == 2 and fit["photos"] == 4
    assert fit["share_34"] is None and 0 < start["seconds"] < 100
    assert "coarse.fit_coarse_field" in start["longest"]


def test_without_a_gpu_it_says_what_it_would_do(gpu, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["gpu.py", "--dry-run"])
    gpu.main()
    said = capsys.readouterr().out
    assert said.startswith("gpu: nothing measured: ") and all(f"\n{name}: " in said for name in gpu.PARTS)
    assert sum(part.seconds for part in gpu.PARTS.values()) <= 600
