"""SOG, in one file or as a set that streams its levels, made of PLYs by splat-transform: Node.js, the network once."""

import shutil
import subprocess
from pathlib import Path

from dav_gswt.errors import InputError

PACKAGE = "@playcanvas/splat-transform@2.7.1"
CHUNK = 32  # thousand Gaussians of a streamed set that are loaded at once; a level of a patch has a few times as many


def find_converter(target: str) -> str:
    """The program that runs the converter. target: what is made, below exports/. Raises: InputError: it is not here."""
    if (npx := shutil.which("npx")) is None:
        raise InputError(
            f"exports/{target}: SOG needs Node.js 20 or newer with npx, which is not here; PLY, SPZ and GLB do not"
        )
    return npx


def convert(source: Path, path: Path, target: str) -> None:
    """Make `path` of a PLY. The axes stay. Raises: InputError: no Node.js, or what the program complains of."""
    _run([str(source), str(path), "-g", "cpu"], target)


def convert_streamed(sources: list[Path], path: Path, extent: float, target: str) -> None:
    """Make lod-meta.json and the chunks beside it of one PLY a level, the finest first.

    extent: width of a chunk in world units, to the nearest whole number that the converter takes. Raises: as `convert`.
    """
    tagged = [word for level, source in enumerate(sources) for word in (str(source), "-l", str(level))]
    _run([*tagged, str(path), "-g", "cpu", "-C", str(CHUNK), "-X", str(max(1, round(extent)))], target)


def _run(arguments: list[str], target: str) -> None:
    command = [find_converter(target), "--yes", PACKAGE, "-w", "-q", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        message = (done.stderr or done.stdout).strip().splitlines()[-3:]
        raise InputError(f"exports/{target}: {PACKAGE} failed: {' '.join(message) or done.returncode}")
