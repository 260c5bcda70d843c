"""`dav-gswt inspect PATH`: show a result of the workflow in a window, as a picture or as a page."""

import argparse
import importlib.util
import os
import sys
from pathlib import Path

from dav_gswt.errors import InputError

REQUIRED = ("pyvista", "trame_vtk")
FORMATS = (".png", ".html")
MAX_PIXELS = 8192  # of a picture's side
MAX_DRAWN = 300_000  # Gaussians or cells of a map: a browser without a GPU can still turn them


def add_command(commands) -> None:
    """Add the command to a parser's commands."""
    about = "a field, poses, photos, tiles or maps in three dimensions (docs/inspect.md)"
    parser = commands.add_parser("inspect", help=about, description=__doc__)
    parser.add_argument("path", type=Path, help="a file or folder of results/, or any 3D Gaussian .ply")
    save = "a picture (.png) or a page (.html), without a window"
    parser.add_argument("--save", type=Path, metavar="FILE", help=save)
    colour = "fields, levels, tiles: colour, uncertainty; tiles: also patch; scores: a column of the file"
    parser.add_argument("--colour", help=colour)
    parser.add_argument("--level", type=int, help="of levels and tiles")
    parser.add_argument("--part", help="of an .exr of several or of maps.npz: its name, such as above or pose_0010")
    parser.add_argument("--channel", help="of maps, such as Z or w2_sq")
    size = "pixels of window and picture (default: 1280 800)"
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 800), metavar=("W", "H"), help=size)
    most = f"the largest number of Gaussians that are drawn (default: {MAX_DRAWN})"
    parser.add_argument("--most", type=int, default=MAX_DRAWN, metavar="N", help=most)
    parser.set_defaults(run=run_inspect)


def run_inspect(options: argparse.Namespace) -> None:
    """Show or save. Raises: InputError: the extra is not installed, there is no display, or see `read_scene`."""
    if options.save is not None and options.save.suffix not in FORMATS:
        raise InputError(f"--save {options.save}: pictures end in .png and pages in .html")
    if not (min(options.size) >= 16 and max(options.size) <= MAX_PIXELS and options.most > 0):
        raise InputError(f"--size goes from 16 to {MAX_PIXELS} pixels a side, and --most from 1")
    if missing := [name for name in REQUIRED if importlib.util.find_spec(name) is None]:
        how = '.venv/bin/pip install --no-build-isolation -e ".[inspect]"'
        raise InputError(f"inspect: {', '.join(missing)} is not installed: {how}")
    display = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if options.save is None and not display:
        raise InputError("there is no display for a window here: add --save FILE.png or --save FILE.html")
    from dav_gswt.inspect import plot, readers  # here, not above: they need the extra

    given = {name: getattr(options, name) for name in ("colour", "level", "part", "channel")}
    if options.save is not None:
        plot.require_rendering()
    scene = readers.read_scene(options.path, most=options.most, **given)
    plot.show(scene, (options.size[0], options.size[1]), options.save)
    if options.save is not None:
        print(options.save)
