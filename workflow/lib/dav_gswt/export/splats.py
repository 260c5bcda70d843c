"""Export of the terrain: a patch at each level as PLY, and from that SPZ and SOG.

The patch is the sixteen tiles, four by four, with every pair of neighbours once (as many of these side by side as there
are variants): all tiles are visible, no border inside it is, and it is periodic, so copies of it can be placed side by
side without a seam. The tiles one by one are in gswt.zip. Lengths are in the bundle's unit, axes those of each format:
y down in a PLY and in a SOG, y up in an SPZ.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dav_gswt.bundle import gswt
from dav_gswt.errors import InputError
from dav_gswt.export import sog, spz
from dav_gswt.export.axes import Y_DOWN, Y_UP, Z_UP, turn_field
from dav_gswt.export.spool import Spool
from dav_gswt.field import GaussianField, concatenate_fields, read_field, write_field
from dav_gswt.files import atomic_folder
from dav_gswt.logs import progress
from dav_gswt.tiles.layout import EDGES, arrange_torus

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


def convert_plys(plys: Path | str, kind: str, out: Path | str, spz_version: int | None = None) -> None:
    """Convert a folder of level{l}.ply: spz gives level{l}.spz; sog gives level{l}.sog and lod-meta.json.

    The latter is a set that streams its levels, in chunks. The PLYs have y down and so have SOGs; an SPZ has y up, as
    that format wants it. spz_version: of `spz.VERSIONS`; the newest by default.
    Raises: InputError: no PLY, or of SOG: no Node.js, or what the converter complains of.
    """
    names = sorted(Path(plys).glob("level*.ply"), key=lambda path: int(path.stem.removeprefix("level")))
    if not names:
        raise InputError(f"{plys}: there is no level{{l}}.ply in it; make exports/ply again")
    with atomic_folder(out) as folder:
        for name in progress(names, "convert patches"):
            path = folder / f"{name.stem}.{kind}"
            if kind == "spz":
                _write_spz(read_field(name), path, spz_version or spz.VERSIONS[-1])
            else:
                sog.convert(name, path, kind)
        if kind == "sog":
            sog.convert_streamed(names, folder / "lod-meta.json", _measure_tile(names[-1]), kind)


def _write_spz(field: GaussianField, path: Path, version: int) -> None:
    """A field with y down as an SPZ."""
    with TemporaryDirectory(dir=path.parent) as place:
        with Spool(Path(place, "spool")) as spool:
            spool.append(field)
        spz.write_spz(spool, path, version, Y_UP @ Y_DOWN.T)


def _measure_tile(ply: Path) -> float:
    """About a tile's side."""
    return float(np.sort(np.ptp(read_field(ply).means, axis=0))[1]) / TILES_PER_ROW
