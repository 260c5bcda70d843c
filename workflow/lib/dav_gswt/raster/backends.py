"""The rasterizer's backends (the C++ core, plain PyTorch, gsplat on a GPU) and what each can do."""

import os
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.raster.interface import AdamStep, Rasterizer, check, count_columns
from dav_gswt.threads import let_waiting_threads_sleep

NAMES = ("cpu", "torch", "cuda")
VARIABLE = "DAV_GSWT_BACKEND"


@cache
def explain_unavailable(name: str) -> str | None:
    """Why this machine cannot use a backend, and the remedy; None if it can.

    PyTorch, which is slow to import, is imported only for `cuda`, and only if gsplat is installed.
    """
    if name not in NAMES:
        return f"choose from {', '.join(NAMES)}"
    if name == "cpu" and not find_spec("dav_gswt.raster._core"):
        return "the C++ core was not built: install a C++ compiler (Debian, Ubuntu: g++), then type `make run`"
    if name == "torch" and not find_spec("torch"):
        return "PyTorch is not installed: pip install torch"
    if name == "cuda":
        if not find_spec("gsplat"):
            return "gsplat is not installed: pip install gsplat, on a machine with an NVIDIA GPU"
        if not import_module("torch").cuda.is_available():
            return "PyTorch finds no NVIDIA GPU: its driver or a PyTorch with CUDA is missing"
        if import_module("gsplat.cuda._backend")._C is None:
            return "gsplat has no kernels: install the CUDA toolkit (nvcc), or a gsplat that is built for this PyTorch"
    return None


def select_backend() -> str:
    """Name of the backend in use: DAV_GSWT_BACKEND, else cuda with gsplat and a GPU, else cpu, else torch.

    Raises: InputError: DAV_GSWT_BACKEND names one that is unknown or unavailable.
    """
    if given := os.environ.get(VARIABLE):
        if why := explain_unavailable(given):
            raise InputError(f"{VARIABLE}={given}: {why}")
        return given
    return next((name for name in ("cuda", "cpu") if not explain_unavailable(name)), "torch")


def load_backend(name: str | None = None) -> Any:
    """A backend's module, by default of the one in use. Raises: ValueError: it is unknown or unavailable."""
    if name is not None and (why := explain_unavailable(name)):
        raise ValueError(f"no backend '{name}': {why}")
    let_waiting_threads_sleep()
    return import_module(f"dav_gswt.raster.{name or select_backend()}")


def make_rasterizer(backend: str | None = None, **options) -> Rasterizer:
    """A rasterizer of a backend, by default of the one in use. options: of its `Rasterizer`."""
    return load_backend(backend).Rasterizer(**options)


def loss(
    image: Float32[Array, "h w c"],
    target: Float32[Array, "h w c"],
    weight: Float32[Array, "h w"] | None = None,
    structure: float = 0.2,
    threads: int | None = None,
    backend: str | None = None,
) -> tuple[float, Float32[Array, "h w c"]]:
    """(1 - structure) L1 + structure (1 - SSIM), and its gradient by the image.

    With weights w in [0, 1] (None: 1) over N = h w c values,
    loss = 1/N sum of w [(1 - structure) |x - y| + structure (1 - SSIM)].
    SSIM's local means, variances and covariance are weighted averages, by an 11-tap Gaussian (sigma 1.5) times w,
    divided by the window's sum of both: pixels of weight 0 and those beyond the border have no influence, and a uniform
    weight scales loss and gradient. C1 = .01^2, C2 = .03^2, as usual for values in [0, 1].
    Raises: ValueError: an array's type, shape or layout.
    """
    check(image, "image", (*image.shape[:2], count_columns(image)))
    check(target, "target", image.shape)
    if weight is not None:
        check(weight, "weight", image.shape[:2])
    return load_backend(backend).compute_loss(image, target, weight, structure, threads)


def adam(
    values: Float32[Array, "n ..."],
    gradient: Float32[Array, "n ..."],
    first: Float32[Array, "n ..."],
    second: Float32[Array, "n ..."],
    rate: float | Float32[Array, "columns"],
    step: int,
    betas: tuple[float, float] = (0.9, 0.999),
    epsilon: float = 1e-15,
    rows: Bool[Array, "n"] | None = None,
    threads: int | None = None,
    backend: str | None = None,
) -> None:
    """One step of Adam, in place: `values`, and the moments `first` and `second`, which start as zeros.

    values -= rate m / (sqrt(v) + epsilon) with m = first / (1 - beta1^step), v = second / (1 - beta2^step).
    rate: one for all, or one a column (values.size / n). step: counts from 1. rows: only these move; the moments of the
    others stay. Raises: ValueError: an array's type, shape or layout, or a step below 1.
    """
    if step < 1:
        raise ValueError(f"step counts from 1, not {step}")
    for name, array in (("values", values), ("gradient", gradient), ("first", first), ("second", second)):
        check(array, name, values.shape)
        if array is not gradient and not array.flags.writeable:
            raise ValueError(f"{name} is read-only, but is to be changed in place")
    if rows is not None:
        check(rows, "rows", values.shape[:1], np.bool_)
    rates, columns = np.asarray(rate, np.float32).reshape(-1), values.size // max(1, len(values))
    if len(rates) not in (1, columns):
        raise ValueError(f"rate must be one number or {columns}, one a column, not {len(rates)}")
    given = AdamStep(values, gradient, first, second, rates, step, betas, epsilon, rows, threads)
    load_backend(backend).step_adam(given)


def describe_backend() -> dict[str, str]:
    """The backend in use and all that its last bits depend on, for the provenance of results."""
    name = select_backend()
    if name == "cpu":
        core = import_module("dav_gswt.raster.cpu")
        return {"backend": name, "instruction_set": core.default_instruction_set()}
    torch = import_module("torch")
    if name == "torch":
        return {"backend": name, "torch": torch.__version__, "instruction_set": torch.backends.cpu.get_cpu_capability()}
    return {"backend": name, "gsplat": metadata.version("gsplat"), "device": torch.cuda.get_device_name()}
