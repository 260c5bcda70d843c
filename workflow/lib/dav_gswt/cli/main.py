"""`dav-gswt`: the commands beside `make run` and `make view`."""

import argparse
import sys
from pathlib import Path

from dav_gswt.cli import export, gaps, make, run_safely
from dav_gswt.errors import InputError
from dav_gswt.inspect import command as inspect
from dav_gswt.terrain import serve


def main(arguments: list[str] | None = None) -> int:
    """Run a command. Returns the exit status: 1, with a message, where the input cannot be used."""
    parser = argparse.ArgumentParser(prog="dav-gswt", description=__doc__)
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
    """The folder of a page: the folder itself, the page in it, or without a folder the newest one here.

    Raises: InputError: there is none.
    """
    if folder is not None:
        return folder / "page" if (folder / "page/index.html").is_file() else folder
    found = [path.parent for path in Path().glob("*/page/index.html")] + [
        path.parent for path in Path().glob("page/index.html")
    ]
    if not found:
        raise InputError("there is no terrain here: `dav-gswt make PHOTOS` makes one, `dav-gswt view FOLDER` opens it")
    return max(found, key=lambda path: (path / "index.html").stat().st_mtime)


if __name__ == "__main__":
    sys.exit(main())
