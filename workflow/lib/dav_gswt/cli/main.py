"""Photos of ground become an endless terrain: `dav-gswt make PHOTOS`, then `dav-gswt view`."""

import argparse
import sys
from pathlib import Path

from dav_gswt.cli import export, gaps, make, run_safely
from dav_gswt.errors import InputError
from dav_gswt.files import REPOSITORY
from dav_gswt.inspect import command as inspect
from dav_gswt.terrain import serve


def main(arguments: list[str] | None = None) -> int:
    """Run a command. Returns the exit status: 1, with a message, where the input cannot be used."""
    pages = f"Files that messages name (docs/..., workflow/...) are in {REPOSITORY}."
    whole = argparse.RawDescriptionHelpFormatter  # breaks no path
    parser = argparse.ArgumentParser(prog="dav-gswt", description=__doc__, epilog=pages, formatter_class=whole)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    make.add_command(commands)
    gaps.add_command(commands)
    inspect.add_command(commands)
    export.add_command(commands)
    about = "walk over a terrain in a browser: serves its page on this machine"
    command = commands.add_parser("view", aliases=["serve"], help=about, description=about)
    command.add_argument("dir", type=Path, nargs="?", help="what `make` wrote, or a page; default: the newest here")
    command.add_argument("--port", type=int, default=8000)
    command.set_defaults(run=lambda options: serve.serve(find_page(options.dir), options.port))
    return run_safely(parser.parse_args(arguments))


def find_page(folder: Path | None) -> Path:
    """The folder of a page: the folder itself, the page in it or of what was made of it; else the newest one here.

    Raises: InputError: there is none.
    """
    if folder is not None:
        places = [folder / "page", make.name_terrain(folder) / "page"]
        return next((place for place in places if (place / "index.html").is_file()), folder)
    found = [path.parent for pattern in ("page", "*/page") for path in Path().glob(f"{pattern}/index.html")]
    if not found:
        raise InputError("there is no terrain here: `dav-gswt make PHOTOS` makes one, `dav-gswt view FOLDER` opens it")
    return max(found, key=lambda path: (path / "index.html").stat().st_mtime)


if __name__ == "__main__":
    sys.exit(main())
