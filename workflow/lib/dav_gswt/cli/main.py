"""`dav-gswt`: the commands beside `make run` and `make view`."""

import argparse
import sys

from dav_gswt.cli import advise, export
from dav_gswt.errors import InputError
from dav_gswt.inspect import command as inspect


def main(arguments: list[str] | None = None) -> int:
    """Run a command; its exit status, 1 with a message where what was given cannot be used."""
    parser = argparse.ArgumentParser(prog="dav-gswt", description=__doc__)
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    inspect.add_command(commands)
    export.add_command(commands)
    advise.add_command(commands)
    options = parser.parse_args(arguments)
    try:
        return options.run(options)
    except (InputError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main())
