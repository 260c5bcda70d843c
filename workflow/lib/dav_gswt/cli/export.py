"""`dav-gswt export PATH -o FOLDER`: files of a finished terrain for other programs, without Snakemake."""

import argparse
import logging
import re
from pathlib import Path
from typing import Any, get_args

from dav_gswt.bundle.manifest import NAME as MANIFEST
from dav_gswt.config.exports import Export, Format
from dav_gswt.config.load import check_model
from dav_gswt.errors import InputError

GROUND = "ground"  # beside the formats of `export.formats`: the files of exports/ground
SCHEMA = Path("workflow/schemas/davgswt.schema.json")  # of a checkout
OPTIONS = {"centre": "at", "formats": "format"}  # where an option has another name than its key of the config


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "a finished terrain for viewers, engines and simulators (docs/exports.md)"
    parser = commands.add_parser("export", help=about, description=__doc__)
    parser.add_argument("path", type=Path, help="a page folder, a bundle, or a folder of results/: its newest page")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FOLDER", help="gets terrain/ and ground/")
    parser._negative_number_matcher = re.compile(r"^-(\d+\.?\d*|\.\d+) ?m?$")  # -12m is a length, no option
    names = (*get_args(Format), GROUND)
    parser.add_argument(
        "--format", action="append", choices=names, dest="formats", metavar="NAME", help=f"any of {', '.join(names)}"
    )
    size = parser.add_argument_group("which cells, in tile sides")
    size.add_argument("--columns", type=int, help="from west to east (default: 8)")
    size.add_argument("--rows", type=int, help="from south to north (default: 8)")
    size.add_argument("--radius", type=_parse_length, help="all within it of --at, instead; 20m: metres")
    size.add_argument("--at", type=_parse_length, nargs=2, dest="centre", metavar=("X", "Y"), help="default: 0 0")
    size.add_argument("--corner", type=int, nargs=2, metavar=("I", "J"), help="south-western cell, instead of --at")
    parser.add_argument("--level", type=_parse_level, help="of detail, 0 the finest (default), or by_distance")
    parser.add_argument("--axes", help="own (default), z-up, y-up or y-down")
    parser.add_argument("--spz-version", type=int, help="2 or 3 (default)")
    parser.add_argument("--tile-compression", help="of 3dtiles: spz (default) or none")
    parser.add_argument("--max-gb", type=float, help="most that a file may take (default: 2)")
    parser.add_argument("--surface", help="of ground: ground (default) or visible")
    parser.add_argument("--mesh-error", type=float, help="of ground, in ground cells (default: 0.25)")
    parser.add_argument("--threads", type=int, default=2)
    parser.set_defaults(run=run_export)


def run_export(options: argparse.Namespace) -> int:
    """Write what is asked for; returns the exit status.

    Raises: InputError: options that exclude one another, no terrain at the path, a folder that is none of ours in the
        way; see also `terrain_files.export_terrain`, `ground_files.export_ground`.
    """
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    try:
        settings, ground = read_settings(options)
        _export(options, settings, ground)
    except InputError as error:
        raise InputError(name_options(str(error))) from error
    return 0


def read_settings(options: argparse.Namespace) -> tuple[dict[str, Any], bool]:
    """The config's `export` that the options ask for, and whether the ground is to be written, too."""
    given = {name: getattr(options, name) for name in Export.model_fields}
    given = {name: value for name, value in given.items() if value is not None}
    if "radius" in given and {"columns", "rows"} & set(given):
        raise InputError("export.radius excludes export.columns and export.rows: leave one or the other out")
    if options.threads < 1:
        raise InputError(f"--threads {options.threads}: at least one is needed")
    formats = list(dict.fromkeys(given.pop("formats", ["glb"])))
    ground = GROUND in formats
    wanted = [name for name in formats if name != GROUND]
    checked = check_model(Export, given | ({"formats": wanted} if wanted else {}), "export")
    return checked.model_dump(mode="json", exclude_none=True) | {"formats": wanted}, ground


def name_options(message: str) -> str:
    """A message about keys of the config as one about options of this command."""

    def rename(match: re.Match[str]) -> str:
        return f"--{OPTIONS.get(match[1], match[1].replace('_', '-'))}"

    message = re.sub(r" \(docs/reference/config\.md lists every key\)$", "", message.removeprefix("config: "))
    return re.sub(rf"\bexport\.({'|'.join(Export.model_fields)})\b", rename, message)


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


def _export(options: argparse.Namespace, settings: dict[str, Any], ground: bool) -> None:
    from dav_gswt.bundle import store  # below the options: they load what is slow to load
    from dav_gswt.export import ground_files, terrain_files
    from dav_gswt.terrain.endless import terrain_from_page

    source = find_terrain(options.path)
    wanted = ["terrain"] * bool(settings["formats"]) + ["ground"] * ground
    for name in wanted:
        check_target(options.out / name, f"{name}.json")
    result = _find_result(source) if ground else None
    bundle = store.read_bundle(source, _find_schema())
    reference = _find_reference(source)
    terrain = terrain_from_page(bundle)
    sets = [] if result is None else _read_sets(result)
    if sets:
        ground_files.check_ground(terrain, bundle.manifest, sets, reference, settings)
    if settings["formats"]:
        terrain_files.export_terrain(
            terrain, bundle.manifest, settings, options.out / "terrain", options.threads, reference
        )
    if sets:
        ground_files.export_ground(terrain, bundle.manifest, sets, reference, settings, options.out / "ground")
    for name in wanted:
        print(options.out / name)


def check_target(folder: Path, mark: str) -> None:
    """Raises: InputError: a folder that this command did not write is in the way, and would be replaced; or a file."""
    if folder.parent.exists() and not folder.parent.is_dir():
        raise InputError(f"-o {folder.parent}: a file is in the way; name a folder")
    if folder.is_symlink() or (folder.exists() and not (folder / mark).is_file()):
        raise InputError(f"{folder} is in the way, and is no export (it has no {mark}): name another folder with -o")


def _find_schema() -> Path:
    """Raises: InputError: this is no checkout."""
    for root in (Path(__file__).parents[4], Path.cwd()):
        if (root / SCHEMA).is_file():
            return root / SCHEMA
    raise InputError(f"{SCHEMA} is not here: work in a checkout of the repository")


def _find_result(source: Path) -> Path:
    """The folder of the tiles of a bundle of results/. Raises: InputError: it is not of results/."""
    for folder in source.resolve().parents:
        if (folder / "seams.json").is_file() and (folder / "tiles").is_dir():
            return folder
    raise InputError(
        f"--format {GROUND} needs the tiles, beside which {source} does not lie: name a folder of results/"
    )


def _read_sets(result: Path):
    from dav_gswt.tiles.store import read_material_tiles

    return read_material_tiles(result / "tiles", result / "seams.json")


def _find_reference(source: Path):
    """Where the scene lies on earth, if it is of results/ and its photos tell."""
    from dav_gswt.geometry.scene_frame import read_scene_frame

    for folder in source.resolve().parents:
        if (frame := folder / "photos/ground.json").is_file():
            return read_scene_frame(frame).georeference
    return None


def _parse_length(text: str) -> float | str:
    """A number of tile sides, or a text such as 20m, as the config has it."""
    if re.fullmatch(r"-?\d+(\.\d+)? ?m", text):
        return text
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no number of tile sides, and not metres as 20m is") from None


def _parse_level(text: str) -> int | str:
    return int(text) if re.fullmatch(r"\d{1,3}", text) else text
