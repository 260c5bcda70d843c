"""A finite terrain as 3D Tiles 1.1: a tree of GLBs, a level of detail a row, which programs load as they come near.

Source: https://docs.ogc.org/cs/22-025r4/22-025r4.html. A tile of level l covers 2^l by 2^l cells and gives way (refine:
REPLACE) to the four of level l - 1 under it; the root has no content. Axes are east, north and up; GLBs have y up, as
the specification wants it.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

import dav_gswt
from dav_gswt.export.axes import Z_UP
from dav_gswt.export.bounds import Box, find_box, unite_boxes
from dav_gswt.export.glb_splats import EXTENSION, write_glb_splats
from dav_gswt.export.glb_spz import COMPRESSION, write_glb_spz
from dav_gswt.export.spool import Spool
from dav_gswt.files import write_json
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.logs import progress
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt.terrain.finite import Area

# Pixels that programs let a tile be wrong by before they refine it (CesiumJS's maximumScreenSpaceError): a level whose
# error is as many spacings of its Gaussians is refined where these would lie more than a pixel apart.
ALLOWED_PIXELS = 16
GLTF_EXTENSION = "3DTILES_content_gltf"

Placer = Callable[[Area, int], AbstractContextManager[Spool]]  # the Gaussians of cells at a level


@dataclass(frozen=True)
class TileWriter:
    """Writes the contents of a tree.

    Attributes:
        folder: of tileset.json.
        errors: of each level, in units: what is lost where it is shown instead of a finer one; 0 of the finest.
        place: puts cells on the surface.
        extras: of the contents' nodes.
        spz: whether contents are compressed.
    """

    folder: Path
    errors: Sequence[float]
    place: Placer
    extras: Mapping[str, Any]
    spz: bool = False

    def write_tree(self, area: Area) -> dict[str, Any]:
        """The root of an area's tree, its contents written. Raises: ValueError: the area has no Gaussian."""
        top = len(self.errors) - 1
        blocks = progress(split_area(area, 2**top), "write tiles")
        tiles = [self._write_tile(block, top) for block in blocks]
        children, boxes = zip(*[tile for tile in tiles if tile is not None], strict=True)
        box = unite_boxes(list(boxes))
        return {
            "boundingVolume": {"box": to_volume(box)},
            "geometricError": measure_absence(box, self.errors),
            "refine": "REPLACE",
            "children": list(children),
        }

    def _write_tile(self, area: Area, level: int) -> tuple[dict[str, Any], Box] | None:
        """The tile of an area at a level and the finer ones under it, and their box; None: there is no Gaussian."""
        finer = [self._write_tile(part, level - 1) for part in split_area(area, 2 ** (level - 1))] if level else []
        below = [tile for tile in finer if tile is not None]
        boxes, content = [box for _, box in below], None
        with self.place(area, level) as placed:
            if len(placed):
                boxes.append(find_box(placed, Z_UP))
                content = self._write_content(placed, area, level, boxes[-1])
        if not boxes:
            return None
        box = unite_boxes(boxes)
        tile: dict[str, Any] = {"boundingVolume": {"box": to_volume(box)}, "geometricError": self.errors[level]}
        tile |= {"content": content} if content else {}
        return tile | ({"children": [child for child, _ in below]} if below else {}), box

    def _write_content(self, placed: Spool, area: Area, level: int, box: Box) -> dict[str, Any]:
        uri = f"{level}/{area.west}_{area.south}.glb"
        write = write_glb_spz if self.spz else write_glb_splats
        write(placed, self.folder / uri, dict(self.extras) | {"level": level})
        return {"uri": uri, "boundingVolume": {"box": to_volume(box)}}


def write_tileset(
    folder: Path | str,
    area: Area,
    errors: Sequence[float],
    place: Placer,
    facts: Mapping[str, Any],
    transform: Float[Array, "4 4"] | None,
    spz: bool = False,
) -> None:
    """Write tileset.json and {level}/{column}_{row}.glb, named by the south-western cells, to a new folder.

    Args:   errors: of each level, see `TileWriter`. facts: kept in the files' extras. transform: to metres from the
            earth's centre; None: the tileset stays where it is, in the terrain's unit. spz: see `TileWriter`.
    """
    folder = Path(folder)
    folder.mkdir()
    root = TileWriter(folder, errors, place, {"unit": facts["unit"]}, spz).write_tree(area)
    if transform is not None:
        root["transform"] = transform.T.ravel().tolist()  # column by column
    # what GLBs use, so that a program knows before it loads one: CesiumJS draws Gaussians where it is told so here
    extension = {"extensionsUsed": [EXTENSION, COMPRESSION]} if spz else {"extensionsUsed": [EXTENSION]}
    extension |= {"extensionsRequired": [EXTENSION, COMPRESSION]} if spz else {}
    tileset = {
        "asset": {"version": "1.1", "extras": {"generator": f"DAV-GSWT {dav_gswt.__version__}"}},
        "extensionsUsed": [GLTF_EXTENSION],
        "extensions": {GLTF_EXTENSION: extension},
        "extras": dict(facts),
        "geometricError": root["geometricError"],
        "root": root,
    }
    write_json(folder / "tileset.json", tileset)


def measure_errors(terrain: EndlessTerrain) -> list[float]:
    """The geometric error of each level, in units: by the spacing of its Gaussians, if they lay on a square lattice."""
    counts: dict[int, list[int]] = {}
    for (level, _), tile in sorted(terrain.tiles.items(), key=lambda item: item[0]):
        counts.setdefault(level, []).append(len(tile))
    spacings = [terrain.side / np.sqrt(max(np.mean(counts[level]), 1)) for level in range(1, len(terrain.switches))]
    return [0.0, *(float(v) for v in ALLOWED_PIXELS * np.maximum.accumulate(spacings))]


def measure_absence(box: Box, errors: Sequence[float]) -> float:
    """What is lost where nothing is shown: as much as there is, and more than the coarsest level loses."""
    return float(max(np.linalg.norm(box[1] - box[0]), 2 * errors[-1]))


def split_area(area: Area, edge: int) -> list[Area]:
    """Blocks of `edge` by `edge` cells from the south-western one on, row by row; the last ones may be smaller."""
    return [
        Area(area.west + i, area.south + j, min(edge, area.columns - i), min(edge, area.rows - j), area.disc)
        for j in range(0, area.rows, edge)
        for i in range(0, area.columns, edge)
    ]


def to_volume(box: Box) -> list[float]:
    """A box of the specification: its centre and the halves of its sides."""
    low, high = box
    return [*((low + high) / 2).tolist(), *np.diag((high - low) / 2).ravel().tolist()]


def place_on_globe(reference: Georeference, origin: Float[Array, "3"]) -> Float[Array, "4 4"]:
    """Takes coordinates that count from an origin of the world to metres from the earth's centre."""
    shift = np.eye(4)
    shift[:3, 3] = origin
    return reference.to_geocentric @ shift
