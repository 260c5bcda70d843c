"""The code of the extra `cuda` beside the real gsplat, which `.ci/run` brings: what it calls is there, with no GPU."""

import inspect
from importlib import import_module

import pytest
from fixtures import fake_gsplat

gsplat = pytest.importorskip("gsplat", reason="gsplat is not installed: .ci/run tests it in a folder of its own")
CALLED = "rasterization", "spherical_harmonics", "rasterize_to_indices_in_range"


@pytest.mark.parametrize("name", CALLED)
def test_the_stand_in_takes_what_gsplat_takes(name):
    real = inspect.signature(getattr(gsplat, name)).parameters
    faked = inspect.signature(getattr(fake_gsplat, name)).parameters
    assert set(faked) <= set(real)
    for parameter, given in faked.items():
        if given.default is not inspect.Parameter.empty:
            assert given.default == real[parameter].default, parameter


@pytest.mark.parametrize("module", ["raster.cuda", "reconstruction.fitting.device_descent"])
def test_what_is_written_for_a_gpu_can_be_imported(module):
    assert import_module(f"dav_gswt.{module}")
