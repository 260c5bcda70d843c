"""Selection of the rasterizer's backend: the C++ core, plain PyTorch, or gsplat on a GPU."""

import os
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from typing import TYPE_CHECKING, cast

from dav_gswt import threads
from dav_gswt.errors import InputError
from dav_gswt.raster.interface import Backend

if TYPE_CHECKING:
    from dav_gswt.raster import cpu, cuda, torch

    BACKENDS: tuple[Backend, ...] = cpu, torch, cuda  # each module fits the protocol

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


def load_backend(name: str | None = None) -> Backend:
    """A backend's module, by default that of the one in use. Raises: ValueError: it is unknown or unavailable."""
    if name is not None and (why := explain_unavailable(name)):
        raise ValueError(f"no backend '{name}': {why}")
    threads.let_waiting_threads_sleep()
    return cast(Backend, import_module(f"dav_gswt.raster.{name or select_backend()}"))


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
