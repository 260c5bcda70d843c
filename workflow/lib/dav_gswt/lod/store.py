"""The levels of detail of a field, how many a tile set may have, and their files in one folder.

level{l}.ply, the grid level{l}.exr of each, and levels.json; the levels of further materials are in the folders
material1, material2, ... of the first one's.
"""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, mean_scale, read_field, write_field
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.reconstruction import ground
from dav_gswt.reconstruction.ground import Ground

AUTO = "auto"  # as many levels as save enough Gaussians
MAX_LEVELS = 6  # with AUTO


@dataclass(frozen=True)
class Levels:
    """A field at several levels of detail, finest first.

    Attributes:
        fields, grids: the Gaussians of each level and its ground grid.
        wanted: how many levels the tiles are to have: a number or AUTO.
        stopped: why no coarser level was fitted, as a message.
    """

    fields: list[GaussianField]
    grids: list[Ground]
    wanted: int | str
    stopped: str


def material_folder(folder: Path | str, number: int) -> Path:
    """Where the files of a material are; those of the first are in the folder itself."""
    return Path(folder, f"material{number}") if number else Path(folder)


def write_levels(sets: list[Levels], folder: Path | str, provenance: dict) -> None:
    """Write the levels of each material; the folder appears whole or not at all."""
    with atomic_folder(folder) as part:
        for material, levels in enumerate(sets):
            own, table = material_folder(part, material), []
            own.mkdir(exist_ok=True)
            for number, (f, grid) in enumerate(zip(levels.fields, levels.grids, strict=True)):
                write_field(f, own / f"level{number}.ply")
                ground.write_ground(grid, own / f"level{number}.exr")
                entry = {"level": number, "spacing": grid.spacing, "gaussians": len(f), "mean_scale": mean_scale([f])}
                table.append(entry)
            content = {"wanted": levels.wanted, "levels": table, "stopped": levels.stopped, "provenance": provenance}
            write_json(own / "levels.json", content)


def read_material_levels(folder: Path | str) -> list[Levels]:
    """Read what `write_levels` wrote. Raises: InputError: see `read_levels`."""
    sets = [read_levels(folder)]
    while material_folder(folder, len(sets)).is_dir():
        sets.append(read_levels(material_folder(folder, len(sets))))
    return sets


def read_levels(folder: Path | str) -> Levels:
    """Read the levels of the first material. Raises: InputError: a file is missing or not what levels.json says."""
    folder = Path(folder)
    content = read_json(folder / "levels.json")
    try:
        counts = [entry["gaussians"] for entry in content["levels"]]
        wanted, stopped = content["wanted"], content["stopped"]
        if not counts or not isinstance(wanted, int | str) or not isinstance(stopped, str):
            raise ValueError("a value is of another type")
    except (KeyError, TypeError, ValueError) as error:
        why = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{folder / 'levels.json'}: not a table of levels ({why}); make the levels again") from error
    names = [folder / f"level{number}" for number in range(len(counts))]
    fields = [read_field(f"{name}.ply") for name in names]
    if [len(f) for f in fields] != counts:
        raise InputError(f"{folder}: the levels are not those that levels.json lists; make them again")
    return Levels(fields, [ground.read_ground(f"{name}.exr") for name in names], wanted, stopped)
