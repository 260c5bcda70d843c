"""Export of the terrain: a patch at each level as PLY, and from that SPZ and SOG.

The patch is the sixteen tiles, four by four, with every pair of neighbours once (as many of these side by side as there
are variants): all tiles are visible, no border inside it is, and it is periodic, so copies of it can be placed side by
side without a seam. The tiles one by one are in gswt.zip. Lengths are in the bundle's unit, axes those of each format:
y down in a PLY and in a SOG, y up in an SPZ.
"""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np

from dav_gswt.bundle import gswt
from dav_gswt.errors import InputError
from dav_gswt.export.axes import Y_DOWN, Z_UP, turn_field
from dav_gswt.field import GaussianField, concatenate_fields, read_field, write_field
from dav_gswt.files import atomic_folder
from dav_gswt.logs import progress
from dav_gswt.tiles.layout import EDGES, arrange_torus

PACKAGE = "@playcanvas/splat-transform@2.7.1"
SPZ_VERSION = 3  # the newest that most readers of SPZ take
CHUNK = 32  # thousand Gaussians of a streamed SOG that are loaded at once; a level of a patch has a few times as many
TILES_PER_ROW = 4  # tiles
AXES = {"ply": Y_DOWN, "ply_z-up": Z_UP}  # by the name of the folder below exports/


def assemble_patch(fields: list[GaussianField], side: float) -> GaussianField:
    """One level's tiles, side by side; the south-western corner is the origin."""
    parts = []
    for variant in range(len(fields) // EDGES):
        for (row, column), tile in np.ndenumerate(arrange_torus(variant)[1:-1, 1:-1]):
            corner = np.array([(TILES_PER_ROW * variant + column) * side, row * side, 0.0], np.float32)
            parts.append(replace(fields[tile], means=fields[tile].means + corner))
    return concatenate_fields(parts)


def write_plys(archive: Path | str, side: float, out: Path | str, axes: str = "ply") -> None:
    """Write level{l}.ply of every level of a gswt.zip to a folder. axes: a key of AXES.

    Raises: InputError: see `gswt.read_gswt`.
    """
    fields = gswt.read_gswt(archive, side)
    with atomic_folder(out) as folder:
        for level, tiles in enumerate(progress(fields, "write patches")):
            patch = turn_field(assemble_patch(tiles, side), AXES[axes])
            write_field(patch, folder / f"level{level}.ply", plain=True)


def convert_plys(plys: Path | str, kind: str, out: Path | str) -> None:
    """Convert a folder of level{l}.ply: spz gives level{l}.spz; sog gives level{l}.sog and lod-meta.json.

    The latter is a set that streams its levels, in chunks. The PLYs have y down; the converter turns an SPZ to have y
    up, as that format wants it.
    By PACKAGE, which npx fetches the first time. Raises: InputError: no Node.js, or what the program complains of.
    """
    names = sorted(Path(plys).glob("level*.ply"), key=lambda path: int(path.stem.removeprefix("level")))
    if not names:
        raise InputError(f"{plys}: there is no level{{l}}.ply in it; make exports/ply again")
    with atomic_folder(out) as folder:
        for name in names:
            options = ["--spz-version", str(SPZ_VERSION)] if kind == "spz" else ["-g", "cpu"]
            _run_converter([str(name), str(folder / f"{name.stem}.{kind}"), *options], kind)
        if kind == "sog":
            tagged = [word for level, name in enumerate(names) for word in (str(name), "-l", str(level))]
            chunks = ["-C", str(CHUNK), "-X", str(_measure_tile(names[-1]))]
            _run_converter([*tagged, str(folder / "lod-meta.json"), "-g", "cpu", *chunks], kind)


def _measure_tile(ply: Path) -> int:
    """A tile's side to the nearest whole unit that the converter takes: chunks of a streamed set are as large."""
    return max(1, round(float(np.sort(np.ptp(read_field(ply).means, axis=0))[1]) / TILES_PER_ROW))


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
