"""Which backend draws, what that costs who does not use it, and what is said where it cannot."""

import os
import subprocess
import sys

import numpy as np
import pytest
from fixtures.raster_scenes import CAMERAS, gaussians, relative

from dav_gswt import raster
from dav_gswt.errors import InputError
from dav_gswt.provenance import record_provenance
from dav_gswt.raster import backends

WITHOUT_CORE = """
import sys
sys.modules["dav_gswt.raster._core"] = None  # Python's way to say that there is none
from dav_gswt import raster
from dav_gswt.raster import backends
"""


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


@needs_core
def test_the_core_draws_where_nothing_else_is_set(monkeypatch):
    monkeypatch.delenv(backends.VARIABLE, raising=False)
    if backends.explain_unavailable("cuda"):
        assert backends.select_backend() == "cpu"
        assert type(raster.Rasterizer()) is backends.load_backend("cpu").Rasterizer


@pytest.mark.parametrize("name", [n for n in backends.NAMES if not backends.explain_unavailable(n)])
def test_the_chosen_backend_renders_and_stands_in_the_provenance(monkeypatch, name):
    monkeypatch.setenv(backends.VARIABLE, name)
    drawing = raster.Rasterizer(near=0.5, dilation=0.2)
    assert isinstance(drawing, raster.Rasterizer) and type(drawing) is backends.load_backend(name).Rasterizer
    assert (drawing.near, drawing.dilation) == (0.5, 0.2)
    assert record_provenance({}, {})["renderer"]["backend"] == name


def test_loss_and_adam_are_those_of_the_backend_in_use(monkeypatch):
    monkeypatch.setenv(backends.VARIABLE, "torch")
    called, zeros = [], np.zeros((4, 4, 3), np.float32)
    torch = backends.load_backend("torch")
    monkeypatch.setattr(torch.loss, "compute", lambda *a: called.append("loss") or (0.0, zeros))
    monkeypatch.setattr(torch.adam, "compute", lambda step: called.append("adam"))
    raster.loss(zeros, zeros)
    raster.adam(zeros, zeros, zeros, zeros, rate=0.1, step=1)
    assert called == ["loss", "adam"]


def test_an_unknown_name_is_refused_with_those_that_there_are(monkeypatch):
    monkeypatch.setenv(backends.VARIABLE, "gpu")
    with pytest.raises(InputError, match="DAV_GSWT_BACKEND=gpu: choose from cpu, torch, cuda"):
        raster.Rasterizer()


def test_a_backend_that_is_not_here_is_refused_with_what_to_do(monkeypatch):
    if not (why := backends.explain_unavailable("cuda")):
        pytest.skip("here it is")
    monkeypatch.setenv(backends.VARIABLE, "cuda")
    with pytest.raises(InputError) as refused:
        raster.Rasterizer()
    assert str(refused.value) == f"DAV_GSWT_BACKEND=cuda: {why}"
    assert "install" in why or "driver" in why
    with pytest.raises(ValueError, match="no backend 'cuda'"):
        backends.load_backend("cuda")


@needs_core
@pytest.mark.skipif(not backends.explain_unavailable("cuda"), reason="where gsplat is, torch is asked for a GPU")
def test_who_has_no_gsplat_does_not_wait_for_torch():
    code = "import sys; from dav_gswt import raster; raster.Rasterizer(); print('torch' in sys.modules)"
    assert said(code).strip() == "False"


def test_without_the_core_torch_draws():
    assert said(WITHOUT_CORE + "raster.Rasterizer(); print(backends.select_backend())").strip() == "torch"
    assert "install a C++ compiler" in said(WITHOUT_CORE + "print(backends.explain_unavailable('cpu'))")


@pytest.mark.parametrize("name", ["torch", "cpu"])
def test_a_backend_makes_openmp_wait_passively(name):
    if why := backends.explain_unavailable(name):
        pytest.skip(f"{name}: {why}")
    load = f"from dav_gswt.raster import backends; backends.load_backend('{name}')"
    shown = said(load, OMP_DISPLAY_ENV="true")
    assert "OMP_WAIT_POLICY = 'PASSIVE'" in shown and "ACTIVE'" not in shown
    assert "OMP_WAIT_POLICY = 'ACTIVE'" in said(load, OMP_DISPLAY_ENV="true", OMP_WAIT_POLICY="active")


def test_importing_the_library_leaves_the_environment_alone():
    code = "import os; before = dict(os.environ); import dav_gswt.raster; print(dict(os.environ) == before)"
    assert said(code).strip() == "True"


# --- loss and adam of PyTorch's backend against the core's


@needs_core
@pytest.mark.parametrize("weighted", [False, True])
def test_both_losses_are_the_same(weighted):
    cpu, torch = backends.load_backend("cpu"), backends.load_backend("torch")
    rng = np.random.default_rng(0)
    x, y = rng.uniform(0, 1, (2, 40, 33, 3)).astype(np.float32)
    w = (rng.uniform(0, 1.4, (40, 33)).clip(0, 1) * (rng.uniform(0, 1, (40, 33)) > 0.3)).astype(np.float32)
    w[:13, :16] = 0  # a hole wider than a window
    (a, by_a), (b, by_b) = (m.loss(x, (0.7 * x + 0.3 * y), w if weighted else None, 0.3) for m in (cpu, torch))
    assert a == pytest.approx(b, rel=1e-4)  # as the core's own test against float64
    np.testing.assert_allclose(by_a, by_b, atol=2e-3 * np.abs(by_b).max())


@needs_core
@pytest.mark.parametrize("shape", [(50, 3), (70,), (9, 4, 3)])
@pytest.mark.parametrize("some", [False, True])
def test_both_adams_go_the_same_way(shape, some):
    rng = np.random.default_rng(0)
    start = rng.normal(size=shape).astype(np.float32)
    states = [[start.copy(), np.zeros_like(start), np.zeros_like(start)] for _ in range(2)]
    for step in range(1, 30):
        gradient = rng.normal(size=shape).astype(np.float32)
        rows = rng.uniform(size=len(start)) > 0.5 if some else None
        for (value, *moments), name in zip(states, ("cpu", "torch"), strict=True):
            backends.load_backend(name).adam(
                value, gradient, *moments, rate=0.01, step=step, betas=(0.8, 0.99), rows=rows
            )
    for a, b in zip(*states, strict=True):
        np.testing.assert_allclose(a, b, atol=2e-6)  # 30 steps, 6e-8 of about 1 each


@needs_core
@pytest.mark.parametrize("shape, rates", [((50, 3), 3), ((9, 4, 3), 12)])
def test_a_rate_for_each_column_moves_each_by_its_own(shape, rates):
    rng = np.random.default_rng(0)
    rate = rng.uniform(0.01, 0.1, rates).astype(np.float32)
    gradient = rng.normal(size=shape).astype(np.float32)
    moved = []
    for name in ("cpu", "torch"):
        value, *moments = (np.zeros(shape, np.float32) for _ in range(3))
        backends.load_backend(name).adam(value, gradient, *moments, rate=rate, step=1)
        moved.append(value.reshape(len(value), -1))
    wanted = np.broadcast_to(-rate, moved[0].shape) * np.sign(gradient.reshape(len(gradient), -1))
    for found in moved:
        np.testing.assert_allclose(found, wanted, rtol=1e-5)  # the first step has the length of the rate


# --- extremes that the common scenes do not have


def test_torch_stays_finite_at_all_extremes():
    rng = np.random.default_rng(2)
    n = 1000
    arrays = gaussians(n)
    arrays["means"] *= 10 ** rng.uniform(-10, 8, (n, 1)).astype(np.float32)
    arrays["log_scales"] = rng.uniform(-80, 60, (n, 3)).astype(np.float32)
    arrays["quats"] *= 10 ** rng.uniform(-30, 30, (n, 1)).astype(np.float32)
    arrays["opacity_logits"] = rng.choice(np.float32([-1e30, -100, -5.5, 0, 5, 100, 1e30]), n)
    for camera in CAMERAS.values():
        for options in ({}, {"antialiased": True}, {"dilation": 0.0}):
            drawing = backends.load_backend("torch").Rasterizer(**options)
            seen = drawing.forward(**arrays, camera=camera)
            assert all(np.isfinite(i).all() for i in vars(seen).values() if i is not None)
            found = drawing.backward(seen.colour, seen.alpha, seen.depth)
            assert all(np.isfinite(g).all() for g in vars(found).values() if g is not None), options


def test_torch_gives_the_same_bits_again():
    runs = []
    for _ in range(2):
        drawing = backends.load_backend("torch").Rasterizer()
        seen = drawing.forward(**gaussians(2000), camera=CAMERAS["pinhole"])
        runs.append([seen.colour, *vars(drawing.backward(seen.colour, seen.alpha, seen.depth)).values()])
    for a, b in zip(*runs, strict=True):
        np.testing.assert_array_equal(a, b)


def test_how_torch_groups_its_squares_does_not_matter(monkeypatch):
    torch = backends.load_backend("torch")
    pictures, gradients = [], []
    for together in (1, 1 << 14, 1 << 26):
        monkeypatch.setattr(torch, "BATCH", together)
        drawing = torch.Rasterizer()
        seen = drawing.forward(**gaussians(300), camera=CAMERAS["pinhole"])
        pictures.append(seen.colour)
        gradients.append(drawing.backward(seen.colour).means)
    for one in (1, 2):
        np.testing.assert_allclose(pictures[one], pictures[0], atol=1e-6)  # sums of matrix products, in other orders
        assert relative(gradients[one], gradients[0]) < 1e-5
