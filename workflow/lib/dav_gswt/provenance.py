"""Where a result comes from: the code, the parameters, the bytes of every input. Times stand in benchmarks only."""

import os
import platform
from pathlib import Path

import dav_gswt
from dav_gswt.files import digest
from dav_gswt.raster import backends


def of(inputs: dict[str, Path | str], parameters: dict) -> dict:
    """A JSON value that says what a result was made from and with."""
    return {
        "version": dav_gswt.__version__,
        "renderer": backends.described(),
        "parameters": parameters,
        "inputs": {name: digest(path) for name, path in sorted(inputs.items())},
    }


def machine() -> dict:
    """The processor's name and how many cores it has: what seconds are to be read with."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return {"processor": names[0] if names else platform.processor() or platform.machine(), "cores": os.cpu_count()}
