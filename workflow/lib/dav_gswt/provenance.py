"""Where a result comes from: the code, the parameters, the bytes of every input. Times stand in benchmarks only."""

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
