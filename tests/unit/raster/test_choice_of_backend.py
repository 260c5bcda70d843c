"""Which backend draws, what that costs who does not use it, what is said where it cannot; and what is drawn."""

import os
import subprocess
import sys

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians

from dav_gswt import raster
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.provenance import record_provenance
from dav_gswt.raster import backends, harmonics, render


def said(code: str, **env: str) -> str:
    """What a fresh Python prints."""
    clean = {k: v for k, v in os.environ.items() if k not in (backends.VARIABLE, "OMP_WAIT_POLICY")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=clean | env)
    return done.stdout + done.stderr


needs_core = pytest.mark.skipif(
    bool(backends.explain_unavailable("cpu")), reason=f"cpu: {backends.explain_unavailable('cpu')}"
)


def test_the_core_is_there():
    if why := backends.explain_unavailable("cpu"):
        pytest.skip(f"cpu: {why}; all tests of the core itself are left out")
    assert backends.load_backend("cpu").instruction_sets()


@pytest.mark.parametrize("name", [n for n in backends.NAMES if not backends.explain_unavailable(n)])
def test_the_chosen_backend_renders_and_stands_in_the_provenance(monkeypatch, name):
    monkeypatch.setenv(backends.VARIABLE, name)
    drawing = raster.make_rasterizer(near=0.5, dilation=0.2)
    assert isinstance(drawing, raster.Rasterizer) and type(drawing) is backends.load_backend(name).Rasterizer
    assert (drawing.near, drawing.dilation) == (0.5, 0.2)
    assert record_provenance({}, {})["renderer"]["backend"] == name


def test_a_backend_that_is_unknown_or_not_here_is_refused_with_what_to_do(monkeypatch):
    monkeypatch.setenv(backends.VARIABLE, "gpu")
    with pytest.raises(InputError, match="DAV_GSWT_BACKEND=gpu: choose from cpu, torch, cuda"):
        raster.make_rasterizer()
    with pytest.raises(ValueError, match="no backend 'gpu': choose from cpu, torch"):
        backends.load_backend("gpu")
    if not (why := backends.explain_unavailable("cuda")):
        pytest.skip("here it is")
    monkeypatch.setenv(backends.VARIABLE, "cuda")
    with pytest.raises(InputError) as refused:
        raster.make_rasterizer()
    assert str(refused.value) == f"DAV_GSWT_BACKEND=cuda: {why}"


def test_without_the_core_torch_draws(monkeypatch):
    monkeypatch.delenv(backends.VARIABLE, raising=False)
    there = {"torch": True, "gsplat": False, "dav_gswt.raster._core": False}
    monkeypatch.setattr(backends, "find_spec", there.get)
    monkeypatch.setattr(backends, "explain_unavailable", backends.explain_unavailable.__wrapped__)  # without its memory
    assert backends.select_backend() == "torch"
    assert "install a C++ compiler" in backends.explain_unavailable("cpu")
    there["dav_gswt.raster._core"] = True
    assert backends.select_backend() == "cpu" and backends.explain_unavailable("torch") is None
    there["torch"] = False
    assert "PyTorch is not installed" in backends.explain_unavailable("torch")


@needs_core
@pytest.mark.skipif(not backends.explain_unavailable("cuda"), reason="where gsplat is, torch is asked for a GPU")
def test_the_library_leaves_the_environment_alone_and_who_has_no_gsplat_does_not_wait_for_torch():
    code = "import os, sys; before = dict(os.environ); from dav_gswt import raster; print(dict(os.environ) == before)"
    assert said(code + "; raster.make_rasterizer(); print('torch' in sys.modules)").split() == ["True", "False"]


@pytest.mark.parametrize("name", ["cpu", pytest.param("torch", marks=pytest.mark.slow)])
def test_a_backend_makes_openmp_wait_passively(name):
    if why := backends.explain_unavailable(name):
        pytest.skip(f"{name}: {why}")
    load = f"from dav_gswt.raster import backends; backends.load_backend('{name}')"
    shown = said(load, OMP_DISPLAY_ENV="true")
    assert "OMP_WAIT_POLICY = 'PASSIVE'" in shown and "ACTIVE'" not in shown
    assert "OMP_WAIT_POLICY = 'ACTIVE'" in said(load, OMP_DISPLAY_ENV="true", OMP_WAIT_POLICY="active")


# --- PyTorch's backend


def field(n: int = 100, degree: int = 0) -> GaussianField:
    arrays = gaussians(n)
    sh = np.concatenate(
        [
            rgb_to_sh(arrays["colours"]),
            0.2 * gaussians(n, channels=3 * ((degree + 1) ** 2 - 1))["colours"].reshape(n, -1, 3),
        ],
        axis=1,
    )
    names = ("means", "log_scales", "quats", "opacity_logits")
    return GaussianField(*(arrays[k] for k in names), sh.astype(np.float32), np.zeros(n, np.float32), np.zeros(n, bool))


def test_the_picture_is_linear_in_the_background():
    camera = CAMERAS["pinhole"]
    black, grey, red, both = (
        render(field(), camera, background).colour for background in (0.0, 0.25, (1, 0, 0), (1.25, 0.25, 0.25))
    )
    np.testing.assert_allclose(grey + red - black, both, atol=1e-6)
    alpha = render(field(), camera).alpha
    np.testing.assert_allclose((red - black)[..., 0], 1 - alpha, atol=1e-6)


# --- spherical harmonics


def test_harmonics_have_the_signs_that_3dgs_gives_them():
    # looking along +x, +y, +z: degree 1 is (-y, z, -x) sqrt(3 / 4 pi)
    c = np.sqrt(3 / (4 * np.pi))
    np.testing.assert_allclose(harmonics.basis(np.eye(3), 1)[:, 1:], [[0, 0, -c], [-c, 0, 0], [0, c, 0]], atol=1e-15)
