"""Levels on disk, in one folder: level{l}.ply, the grid level{l}.exr of each, and levels.json."""

from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.field import mean_scale, read_field, write_field
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.lod.levels import Levels
from dav_gswt.reconstruction import ground


def write_levels(levels: Levels, folder: Path | str, provenance: dict) -> None:
    """Write the levels; the folder appears whole or not at all."""
    with atomic_folder(folder) as part:
        for number, (fitted, grid) in enumerate(zip(levels.fields, levels.grids, strict=True)):
            write_field(fitted, part / f"level{number}.ply")
            ground.write_ground(grid, part / f"level{number}.exr")
        table = [
            {"level": number, "spacing": grid.spacing, "gaussians": len(f), "mean_scale": mean_scale([f])}
            for number, (f, grid) in enumerate(zip(levels.fields, levels.grids, strict=True))
        ]
        told = {"wanted": levels.wanted, "levels": table, "stopped": levels.stopped, "provenance": provenance}
        write_json(part / "levels.json", told)


def read_levels(folder: Path | str) -> Levels:
    """Read what `write_levels` wrote. Raises: InputError: a file is missing or not what levels.json says."""
    folder = Path(folder)
    told = read_json(folder / "levels.json")
    try:
        counts = [entry["gaussians"] for entry in told["levels"]]
        wanted, stopped = told["wanted"], told["stopped"]
    except (KeyError, TypeError) as error:
        raise InputError(f"{folder / 'levels.json'}: {error} is missing; make the levels again") from None
    fields = [read_field(folder / f"level{number}.ply") for number in range(len(counts))]
    if [len(f) for f in fields] != counts:
        raise InputError(f"{folder}: the levels are not those that levels.json tells of; make them again")
    return Levels(
        fields, [ground.read_ground(folder / f"level{number}.exr") for number in range(len(counts))], wanted, stopped
    )
