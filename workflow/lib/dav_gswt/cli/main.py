"""`dav-gswt`: the commands beside `make run` and `make view`."""

import argparse
import sys
from pathlib import Path

from dav_gswt.cli import export, run_safely
from dav_gswt.inspect import command as inspect
from dav_gswt.terrain import serve


def main(arguments: list[str] | None = None) -> int:
    """Run a command. Returns the exit status: 1, with a message, where the input cannot be used."""
    parser = argparse.ArgumentParser(prog="dav-gswt", description=__doc__)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    inspect.add_command(commands)
    export.add_command(commands)
    about = "serve a page folder on this machine"
    command = commands.add_parser("serve", help=about, description=about)
    command.add_argument("dir", type=Path, help="a page folder, as make_page writes it")
    command.add_argument("--port", type=int, default=8000)
    command.set_defaults(run=lambda options: serve.serve(options.dir, options.port))
    return run_safely(parser.parse_args(arguments))


if __name__ == "__main__":
    sys.exit(main())
