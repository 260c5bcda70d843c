"""`dav-gswt export PATH -o FOLDER`: files of a finished terrain for other programs, without Snakemake."""

import argparse
import logging
import zipfile
from pathlib import Path
from typing import Any, get_args

import yaml

from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.config.load import check_model
from dav_gswt.config.settings import Export, Format
from dav_gswt.errors import InputError

GROUND = "ground"  # beside the formats of `export.formats`: the files of exports/ground,
GSWT, TILES = "gswt", "tiles"  # the tile set for the public renderer, and as a PLY a tile and level
MORE = (GROUND, GSWT, TILES)
LISTS = {"centre": {"nargs": 2, "metavar": ("X", "Y")}, "formats": {"nargs": "+", "action": "extend"}}


def add_command(commands) -> None:
    """Add the command to a parser's commands. Its options are the keys of the config's `export`."""
    about = "a finished terrain for viewers, engines and simulators (docs/exports.md)"
    parser = commands.add_parser("export", help=about, description=__doc__)
    parser.add_argument("path", type=Path, help="a page folder, a bundle, or a folder of results/: its newest page")
    parser.add_argument(
        "-o", "--out", type=Path, required=True, metavar="FOLDER", help="gets terrain/, ground/, tiles/, gswt.zip"
    )
    for name, field in Export.model_fields.items():
        about = (field.description or "").replace("%", "%%")
        if name == "formats":
            about = f"any of {', '.join((*get_args(Format), *MORE))}; {about}"
        how = LISTS.get(name, {}) | {"help": about}
        parser.add_argument(f"--{name}", type=yaml.safe_load, **how)
    parser.add_argument("--threads", type=int, default=2)
    parser.set_defaults(run=run_export)


def run_export(options: argparse.Namespace) -> None:
    """Write the requested files.

    Raises: InputError: an option makes no sense, the path has no terrain, or a folder that this command did not
        write is in the way; see also `terrain_files.export_terrain` and `ground_files.export_ground`.
    """
    from dav_gswt.bundle import store  # here, not above: these modules are slow to load
    from dav_gswt.export import ground_files, gswt, terrain_files
    from dav_gswt.geometry.scene_frame import read_scene_frame
    from dav_gswt.terrain.endless import terrain_from_page
    from dav_gswt.tiles.store import read_material_tiles

    logging.basicConfig(level=logging.INFO, format="%(message)s")
    settings, more = read_settings(options)
    source, sets, ground = find_terrain(options.path), [], GROUND in more
    wanted = ["terrain"] * bool(settings["formats"]) + ["ground"] * ground
    for name in wanted:
        check_target(options.out / name, f"{name}.json")
    if TILES in more:
        check_target(options.out / TILES, gswt.MARK)
    if GSWT in more:
        check_archive(options.out / gswt.NAME)
    parents = source.resolve().parents
    if ground:
        result = next((folder for folder in parents if (folder / "seams.json").is_file()), None)
        if result is None:
            raise InputError(f"--formats {GROUND} needs the tiles of a bundle; name a folder of results/, not {source}")
        sets = read_material_tiles(result / "tiles", result / "seams.json", result.parent / "levels")
    frame = next((file for folder in parents if (file := folder / "photos/ground.json").is_file()), None)
    reference = read_scene_frame(frame).georeference if frame else None
    bundle = store.read_bundle(source)
    terrain, manifest = terrain_from_page(bundle), bundle.manifest
    if ground:
        ground_files.check_ground(terrain, sets, settings)
    if settings["formats"]:
        terrain_files.export_terrain(terrain, manifest, settings, options.out / "terrain", options.threads, reference)
    if ground:
        ground_files.export_ground(terrain, manifest, sets, settings, options.out / "ground")
    if GSWT in more:
        options.out.mkdir(parents=True, exist_ok=True)
        gswt.export_archive(bundle, options.out / gswt.NAME)
    if TILES in more:
        gswt.export_tiles(bundle, options.out / TILES)
    for name in (*wanted, *[gswt.NAME] * (GSWT in more), *[TILES] * (TILES in more)):
        print(options.out / name)


def read_settings(options: argparse.Namespace) -> tuple[dict[str, Any], list[str]]:
    """The config's `export` that the options stand for, and which of MORE are also written."""
    given = {name: getattr(options, name) for name in Export.model_fields if getattr(options, name) is not None}
    if options.threads < 1:
        raise InputError(f"--threads {options.threads}: at least one is needed")
    formats = list(dict.fromkeys(given.pop("formats", ["glb"])))
    wanted = [name for name in formats if name not in MORE]
    checked = check_model(Export, given | ({"formats": wanted} if wanted else {}), "export")
    return checked.model_dump(mode="json", exclude_none=True) | {"formats": wanted}, [
        name for name in MORE if name in formats
    ]


def find_terrain(path: Path) -> Path:
    """The folder of a manifest: a page (the bundle's own if it has one), a bundle, or the newest page below a folder.

    Raises: InputError: there is none.
    """
    if (path / MANIFEST).is_file():
        page = path / "terrain/page"
        return page if (page / MANIFEST).is_file() else path
    for pattern in (f"**/terrain/page/{MANIFEST}", f"**/{MANIFEST}"):
        if found := sorted(path.glob(pattern), key=lambda file: file.stat().st_mtime):
            return found[-1].parent
    raise InputError(f"{path}: no terrain here ({MANIFEST} is missing); `make run` makes one")


def check_target(folder: Path, mark: str) -> None:
    """Raises: InputError: a file, or a folder that this command did not write, is in the way."""
    if folder.parent.exists() and not folder.parent.is_dir():
        raise InputError(f"-o {folder.parent}: a file is in the way; name a folder")
    if folder.is_symlink() or (folder.exists() and not (folder / mark).is_file()):
        raise InputError(f"{folder} is in the way, and is no export (it has no {mark}): name another folder with -o")


def check_archive(path: Path) -> None:
    """Raises: InputError: what is in the way is no archive of tiles, or no folder is where it shall lie."""
    if path.parent.exists() and not path.parent.is_dir():
        raise InputError(f"-o {path.parent}: a file is in the way; name a folder")
    if path.exists() and not (zipfile.is_zipfile(path) and "lod0_tile_00.ply" in zipfile.ZipFile(path).namelist()):
        raise InputError(f"{path} is in the way, and is no archive of tiles: name another folder with -o")
