"""Which rasterizer draws: the C++ core, plain PyTorch, or gsplat on a GPU."""

import os
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from types import ModuleType

from dav_gswt.errors import InputError

NAMES = ("cpu", "torch", "cuda")
VARIABLE = "DAV_GSWT_BACKEND"


@cache
def lacking(name: str) -> str | None:
    """Why a backend cannot be used on this machine and what would help; None where it can.

    PyTorch is imported for `cuda` only, and there only where gsplat is installed: others need not wait for it.
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


def in_use() -> str:
    """The backend's name: DAV_GSWT_BACKEND, else cuda where gsplat and a GPU are there, else cpu, else torch.

    Raises: InputError: DAV_GSWT_BACKEND names one that is unknown or cannot be used here.
    """
    if given := os.environ.get(VARIABLE):
        if why := lacking(given):
            raise InputError(f"{VARIABLE}={given}: {why}")
        return given
    return next((name for name in ("cuda", "cpu") if not lacking(name)), "torch")


def module(name: str | None = None) -> ModuleType:
    """A backend's module, by default that of the one in use. Raises: ValueError: unknown, or cannot be used here."""
    if name is not None and (why := lacking(name)):
        raise ValueError(f"no backend '{name}': {why}")
    return import_module(f"dav_gswt.raster.{name or in_use()}")


def described() -> dict[str, str]:
    """The backend in use and what its last bits depend on, for the provenance of results."""
    name = in_use()
    if name == "cpu":
        return {"backend": name, "instruction_set": module(name).instruction_set()}
    torch = import_module("torch")
    if name == "torch":
        return {"backend": name, "torch": torch.__version__, "instruction_set": torch.backends.cpu.get_cpu_capability()}
    return {"backend": name, "gsplat": metadata.version("gsplat"), "device": torch.cuda.get_device_name()}
