"""Export of the terrain: a patch at each level as PLY, and from that SPZ and SOG.

The patch is the sixteen tiles, four by four, with every pair of neighbours once (as many of these side by side as there
are variants): all tiles are visible, no border inside it is, and it is periodic, so copies of it can be placed side by
side without a seam. The tiles one by one are in gswt.zip. z is up, in the bundle's unit.
"""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.bundle import gswt
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, concatenate_fields, write_field
from dav_gswt.files import atomic_folder
from dav_gswt.logs import progress
from dav_gswt.tiles.layout import EDGES, arrange_torus

PACKAGE = "@playcanvas/splat-transform@2.7.1"
TILES_PER_ROW = 4  # tiles


def assemble_patch(fields: list[GaussianField], side: float) -> GaussianField:
    """One level's tiles, side by side; the south-western corner is the origin."""
    parts = []
    for variant in range(len(fields) // EDGES):
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1]):
            corner = np.array([(TILES_PER_ROW * variant + column) * side, row * side, 0.0], np.float32)
            parts.append(replace(fields[tile], means=fields[tile].means + corner))
    return concatenate_fields(parts)


def write_plys(archive: Path | str, side: float, out: Path | str) -> None:
    """Write level{l}.ply of every level of a gswt.zip to a folder. Raises: InputError: see `gswt.read`."""
    fields = gswt.read_gswt(archive, side)
    with atomic_folder(out) as folder:
        for level, tiles in enumerate(progress(fields, "write patches")):
            write_field(assemble_patch(tiles, side), folder / f"level{level}.ply")


def convert_plys(plys: Path | str, kind: str, out: Path | str) -> None:
    """Convert a folder of level{l}.ply: spz gives level{l}.spz, sog a set that streams its levels, lod-meta.json.

    By PACKAGE, which npx fetches the first time. Raises: InputError: no Node.js, or what the program complains of.
    """
    names = sorted(Path(plys).glob("level*.ply"), key=lambda path: int(path.stem.removeprefix("level")))
    with atomic_folder(out) as folder:
        if kind == "sog":
            tagged = [word for level, name in enumerate(names) for word in (str(name), "-l", str(level))]
            _run_converter([*tagged, str(folder / "lod-meta.json"), "-g", "cpu"], kind)
        else:
            for name in names:
                _run_converter([str(name), str(folder / f"{name.stem}.spz"), "--spz-version", "3"], kind)


def _run_converter(arguments: list[str], kind: str) -> None:
    npx = shutil.which("npx")
    if npx is None:
        raise InputError(
            f"exports/{kind}: needs Node.js 20 or newer with npx, which is not here; exports/ply needs neither"
        )
    done = subprocess.run([npx, "--yes", PACKAGE, "-w", "-q", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        message = (done.stderr or done.stdout).strip().splitlines()[-3:]
        raise InputError(f"exports/{kind}: {PACKAGE} failed: {' '.join(message) or done.returncode}")
