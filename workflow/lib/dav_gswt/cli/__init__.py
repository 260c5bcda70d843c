"""The command line: `dav-gswt`, and what `make run` and `make view` call."""

import argparse
import signal
import sys
from collections.abc import Callable

from dav_gswt.errors import InputError
from dav_gswt.logs import describe_os_error


def at_least(least: int) -> Callable[[str], int]:
    """The type of an option: a whole number, no less than `least`."""

    def number(text: str) -> int:
        if (value := int(text)) >= least:
            return value
        raise argparse.ArgumentTypeError(f"{text}: must be at least {least}")

    return number


def run_safely(options: argparse.Namespace) -> int:
    """Call `options.run`. Returns its exit status, or that of an error, whose message is printed."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # COLMAP's own handler prints a stack trace
    try:
        return options.run(options) or 0
    except (InputError, OSError) as error:
        print(describe_os_error(error) if isinstance(error, OSError) else error, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
