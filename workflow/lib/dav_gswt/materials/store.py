"""Materials on disk, in one folder: materials.json, maps and a picture of the exemplar, a PLY of everything.

material{k}.ply and its grid material{k}.exr: an exemplar of each material alone. object{kk}.ply: an object around its
foot. materials.exr: what each cell of the exemplar is, the northern row first. materials.png: the same, for people.
ground.png: the exemplar from above, north up, to draw masks over.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.ndimage import binary_dilation

from dav_gswt.field import read_field, write_field
from dav_gswt.files import atomic_folder, read_record, write_json
from dav_gswt.images import figures, image_files
from dav_gswt.lod.merge import merge_by_voxel
from dav_gswt.materials.build import FoundMaterials, MaterialVerdict
from dav_gswt.materials.left_out import LeftOut
from dav_gswt.materials.model import MaterialInfo, ObjectLevels
from dav_gswt.reconstruction import ground

NAME = "materials.json"
STRIP = (0.8, 0.1, 0.1)
SHADED, DARKENED = 0.35, 0.35  # weight of a material's colour; light of what is shown nowhere


@dataclass(frozen=True)
class MaterialRecord(MaterialInfo):
    """A material in materials.json: see `build.Material`."""

    filled: float
    verdict: MaterialVerdict


@dataclass(frozen=True)
class ObjectRecord:
    """An object in materials.json: see `build.ExtractedObject`."""

    name: str
    material: int
    radius: float
    height: float
    density: float


@dataclass(frozen=True)
class SunRecord:
    """The sun that the ground's relief tells, in materials.json: see `shading.Sun`."""

    elevation: float
    azimuth: float


@dataclass(frozen=True)
class MaterialsReport:
    """materials.json.

    Attributes:
        verdict: on the set.
        excluded: share of the exemplar that is shown nowhere.
        tile_side: of tiles of these materials, in cells, where a tiling leaves it open; None: by the texture.
        materials, objects: by number.
        left_out: what stands or is sunk, is cut off, or was seen from above only, and is shown nowhere.
        provenance: of the files that they were made from.
        sun: that shines on them; None: not known.
    """

    verdict: MaterialVerdict
    excluded: float
    tile_side: float | None
    materials: list[MaterialRecord]
    objects: list[ObjectRecord]
    left_out: list[LeftOut]
    provenance: dict[str, Any]
    sun: SunRecord | None = None


def write_materials(found: FoundMaterials, folder: Path | str, provenance: dict[str, Any]) -> None:
    """Write the materials; the folder appears whole or not at all."""
    with atomic_folder(folder) as part:
        for number, material in enumerate(found.materials):
            write_field(material.field, part / f"material{number}.ply")
            ground.write_ground(material.grid, part / f"material{number}.exr")
        for each in found.objects:
            write_field(each.field, part / f"{each.name}.ply")
        classes, place, sun = found.classes, found.maps.exemplar, found.classes.sun
        numbers = sum((k * each.cells for k, each in enumerate(classes.footprints, 1)), np.zeros(classes.kinds.shape))
        layers = {"material": classes.materials, "kind": classes.kinds, "object": numbers, "excluded": classes.excluded}
        header = {name: repr(getattr(place, name)) for name in ("west", "south", "spacing")}
        maps = {name: layer[::-1].astype(np.float32) for name, layer in layers.items()}
        image_files.write_exr(part / "materials.exr", maps, header)
        image_files.write_png(part / "materials.png", draw_classes(found))
        image_files.write_png(part / "ground.png", np.clip(found.maps.colour[::-1], 0, 1))
        report = MaterialsReport(
            found.verdict,
            float(found.classes.excluded.mean()),
            found.tile_side,
            [MaterialRecord(**vars(each.info), filled=each.filled, verdict=each.verdict) for each in found.materials],
            [ObjectRecord(each.name, each.material, each.radius, each.height, each.density) for each in found.objects],
            list(found.left_out),
            provenance,
            sun and SunRecord(round(sun.elevation, 2), round(sun.azimuth, 2) % 360),
        )
        write_json(part / NAME, asdict(report))


def read_report(folder: Path | str) -> MaterialsReport:
    """Read materials.json. Raises: InputError: not readable, or not such a file."""
    return read_record(Path(folder, NAME), MaterialsReport, "find the materials again")


def read_exemplars(folder: Path | str) -> list[tuple[Any, ground.Ground]]:
    """Field and grid of each material's exemplar. Raises: InputError: see `read_report`, `read_field`."""
    paths = [Path(folder, f"material{k}") for k in range(len(read_report(folder).materials))]
    return [(read_field(f"{path}.ply"), ground.read_ground(f"{path}.exr")) for path in paths]


def draw_classes(found: FoundMaterials) -> Float[Array, "h w 3"]:
    """The exemplar from above, north up, as it is and with what was found.

    Materials have colours, strips are red, objects outlined, and what is shown nowhere is dark.
    """
    classes = found.classes
    palette = np.array(figures.KINDS)[np.arange(classes.number) % len(figures.KINDS)]
    picture = (1 - SHADED) * found.maps.colour + SHADED * palette[classes.materials]
    picture[classes.excluded] *= DARKENED
    strips = classes.kinds >= classes.number
    picture[strips] = 0.5 * (found.maps.colour[strips] + STRIP)
    for footprint in classes.footprints:
        picture[binary_dilation(footprint.cells, iterations=2) & ~footprint.cells] = 1
    pair = np.concatenate([found.maps.colour, picture], 1)[::-1]
    return np.clip(pair, 0, 1)


def read_objects(folder: Path | str, levels: int, spacing: float) -> list[ObjectLevels]:
    """The objects at as many levels as the tiles have: at each, Gaussians of a cell twice as wide are merged.

    spacing: width of a finest cell. Raises: InputError: see `read_report`, `read_field`.
    """
    objects = []
    for record in read_report(folder).objects:
        fields = [read_field(Path(folder, f"{record.name}.ply"))]
        for level in range(1, levels):
            fields.append(merge_by_voxel(fields[-1], 2**level * spacing))
        objects.append(ObjectLevels(record.name, fields, record.radius, record.material, record.density))
    return objects
