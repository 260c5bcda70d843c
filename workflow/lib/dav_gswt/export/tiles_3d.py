"""A finite terrain as 3D Tiles 1.1: a tree of GLBs, one level of detail a row, which programs load as they approach.

Source: https://docs.ogc.org/cs/22-025r4/22-025r4.html. A tile of level l covers 2^l by 2^l cells and is replaced
(refine: REPLACE) by the four tiles of level l - 1 below it; the root has no content. Axes are east, north and up; the
GLBs have y up, as the specification requires.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import dav_gswt
from dav_gswt.export.glb import COMPRESSION, EXTENSION, write_splats
from dav_gswt.export.spool import Box, ExportJob, unite_boxes
from dav_gswt.files import write_json
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area

# The error in pixels up to which programs keep a tile (CesiumJS's maximumScreenSpaceError). A level whose error is as
# many spacings of its Gaussians is refined where these would be more than a pixel apart.
ALLOWED_PIXELS = 16
GLTF_EXTENSION = "3DTILES_content_gltf"


def write_tileset(job: ExportJob, folder: Path) -> int:
    """Write tileset.json and {level}/{column}_{row}.glb, named by the south-western cells, to a new folder.

    If the terrain's place on earth is known, the tileset's transform puts it there; else it stays in its own unit.
    Returns: the number of Gaussians. Raises: ValueError: the area has none.
    """
    folder.mkdir()
    writer = _TreeWriter(job, folder, measure_errors(job.terrain))
    root = writer.write_root()
    if job.reference is not None:
        shift = np.eye(4)
        shift[:3, 3] = job.facts["origin"]
        root["transform"] = (job.reference.to_geocentric @ shift).T.ravel().tolist()  # column by column
    # CesiumJS draws Gaussians only if the tileset itself names the extensions of its GLBs
    used = {name: [EXTENSION, COMPRESSION] for name in ("extensionsUsed", "extensionsRequired")}
    tileset = {
        "asset": {"version": "1.1", "extras": {"generator": f"DAV-GSWT {dav_gswt.__version__}"}},
        "extensionsUsed": [GLTF_EXTENSION],
        "extensions": {GLTF_EXTENSION: used},
        "extras": dict(job.facts),
        "geometricError": root["geometricError"],
        "root": root,
    }
    write_json(folder / "tileset.json", tileset)
    return writer.count


@dataclass
class _TreeWriter:
    """Writes the contents of a tree. errors: of each level, see `measure_errors`. count: Gaussians written so far."""

    job: ExportJob
    folder: Path
    errors: list[float]
    count: int = 0

    def write_root(self) -> dict[str, Any]:
        """The root of the tree. Its error exceeds that of the coarsest level: without it there is nothing at all."""
        top = len(self.errors) - 1
        blocks = progress(split_area(self.job.area, 2**top), "write tiles")
        found = [self._write_tile(block, top) for block in blocks]
        box = unite_boxes([box for _, box in found])
        return {
            "boundingVolume": {"box": to_volume(box)},
            "geometricError": float(max(np.linalg.norm(box[1] - box[0]), 2 * self.errors[-1])),
            "refine": "REPLACE",
            "children": [tile for tile, _ in found],
        }

    def _write_tile(self, area: Area, level: int) -> tuple[dict[str, Any], Box]:
        """The tile of an area and the finer ones below it, and their box."""
        below = [self._write_tile(part, level - 1) for part in split_area(area, 2 ** (level - 1))] if level else []
        uri = f"{level}/{area.west}_{area.south}.glb"
        with self.job.place(area, level) as placed:
            self.count += len(placed)
            own = placed.find_box()
            extras = {"unit": self.job.facts["unit"], "level": level}
            write_splats(placed, self.folder / uri, extras, compressed=True)
        box = unite_boxes([*(box for _, box in below), own])
        tile: dict[str, Any] = {"boundingVolume": {"box": to_volume(box)}, "geometricError": self.errors[level]}
        tile["content"] = {"uri": uri, "boundingVolume": {"box": to_volume(own)}}
        return tile | ({"children": [child for child, _ in below]} if below else {}), box


def measure_errors(terrain: EndlessTerrain) -> list[float]:
    """The geometric error of each level, in units, from the spacing of its Gaussians on a square lattice.

    It is what is lost where the level is shown instead of a finer one: 0 for the finest, and never falling.
    """
    counts: dict[int, list[int]] = {}
    for (level, _), tile in sorted(terrain.tiles.items(), key=lambda item: item[0]):
        counts.setdefault(level, []).append(len(tile))
    spacings = [terrain.side / np.sqrt(max(np.mean(counts[level]), 1)) for level in range(1, len(terrain.switches))]
    return [0.0, *(float(v) for v in ALLOWED_PIXELS * np.maximum.accumulate(spacings))]


def split_area(area: Area, edge: int) -> list[Area]:
    """Blocks of `edge` by `edge` cells from the south-western one on, row by row; the last ones may be smaller."""
    return [
        Area(area.west + i, area.south + j, min(edge, area.columns - i), min(edge, area.rows - j))
        for j in range(0, area.rows, edge)
        for i in range(0, area.columns, edge)
    ]


def to_volume(box: Box) -> list[float]:
    """A box of the specification: its centre and the halves of its sides."""
    low, high = box
    return [*((low + high) / 2).tolist(), *np.diag((high - low) / 2).ravel().tolist()]
