"""`dav-gswt inspect PATH`: show a result of the workflow in a window, as a picture or as a page."""

import argparse
import importlib.util
import re
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.inspect.options import MAX_DRAWN, ViewOptions

REQUIRED = ("pyvista", "trame_vtk")
FORMATS = (".png", ".html")
SIZE = (1280, 800)
MAX_PIXELS = 8192  # of a picture's side


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "a field, poses, photos, tiles or maps in three dimensions (docs/inspect.md)"
    parser = commands.add_parser("inspect", help=about, description=__doc__)
    parser.add_argument("path", type=Path, help="a file or folder of results/, or any 3D Gaussian .ply")
    parser.add_argument(
        "--save", type=Path, metavar="FILE", help="a picture (.png) or a page (.html), without a window"
    )
    parser.add_argument(
        "--colour", help="fields, levels: colour, uncertainty, level; tiles: also patch; scores: a column of theirs"
    )
    parser.add_argument("--level", type=int, help="of levels and tiles")
    parser.add_argument("--part", help="of an .exr of several or of maps.npz: its name, such as above or pose_0010")
    parser.add_argument("--channel", help="of maps, such as Z or w2_sq")
    parser.add_argument(
        "--poses", type=Path, metavar="FILE", help="with scores.csv: the poses.json whose poses are marked"
    )
    parser.add_argument(
        "--size", type=_parse_size, default=SIZE, metavar="WxH", help="of window and picture (default: 1280x800)"
    )
    parser.add_argument(
        "--most",
        type=_parse_natural,
        default=MAX_DRAWN,
        metavar="N",
        help=f"Gaussians that are drawn (default: {MAX_DRAWN})",
    )
    parser.set_defaults(run=run_inspect)


def run_inspect(options: argparse.Namespace) -> int:
    """Show or save; returns the exit status. Raises: InputError: there is no display, or see `artifacts`."""
    view_options = ViewOptions(**{name: getattr(options, name) for name in vars(ViewOptions())})
    if options.save is not None and options.save.suffix not in FORMATS:
        raise InputError(f"--save {options.save}: pictures end in .png and pages in .html")
    require_extra()
    from dav_gswt.inspect import artifacts, saving  # below the check: they load what is drawn with

    if options.save is None and not saving.has_display():
        raise InputError("there is no display for a window here: add --save FILE.png or --save FILE.html")
    scene = artifacts.build_scene(options.path, view_options)
    if options.save is None:
        saving.open_window(scene, options.size)
    else:
        saving.prepare_rendering()
        saving.save_scene(scene, options.save, options.size)
        print(options.save)
    return 0


def require_extra() -> None:
    """Raises: InputError: the extra is not installed."""
    if missing := [name for name in REQUIRED if importlib.util.find_spec(name) is None]:
        how = '.venv/bin/pip install --no-build-isolation -e ".[inspect]"'
        raise InputError(f"inspect: {', '.join(missing)} is not installed: {how}")


def _parse_size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"([1-9]\d{1,3})x([1-9]\d{1,3})", text)
    if not match or max(size := (int(match[1]), int(match[2]))) > MAX_PIXELS:
        raise argparse.ArgumentTypeError(f"{text!r} is no size like 1280x800, at most {MAX_PIXELS} a side")
    return size


def _parse_natural(text: str) -> int:
    if not re.fullmatch(r"[1-9]\d{0,8}", text):
        raise argparse.ArgumentTypeError(f"{text!r} is no number of at least 1")
    return int(text)
