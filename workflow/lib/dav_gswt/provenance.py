"""Where a result comes from: the code, the parameters, the bytes of every input. Times stand in benchmarks only."""

from collections.abc import Mapping
from pathlib import Path

import dav_gswt
from dav_gswt.files import digest_files
from dav_gswt.raster import backends


def record_provenance(inputs: Mapping[str, Path | str | list], parameters: dict) -> dict:
    """A JSON value that says what a result was made from and with. Inputs: files, folders, or lists of both."""
    return {
        "version": dav_gswt.__version__,
        "renderer": backends.describe_backend(),
        "parameters": parameters,
        "inputs": {name: digest_files(*_files(given)) for name, given in sorted(inputs.items())},
    }


def _files(given: Path | str | list) -> list[Path]:
    """All files, those of a folder by name, none hidden."""
    paths = [Path(path) for path in ([given] if isinstance(given, Path | str) else given)]
    found = [sorted(p for p in path.rglob("[!.]*") if p.is_file()) if path.is_dir() else [path] for path in paths]
    return [file for files in found for file in files]
