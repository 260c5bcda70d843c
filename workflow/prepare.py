"""Before anything is installed: is what the set-up needs on this machine? Names the package to install if not.

With the argument `core` it says only by its exit code whether the rasterizer's C++ core can be built here.
"""

import importlib.util
import shutil
import sys
import sysconfig
from pathlib import Path

HOW = "On Debian or Ubuntu: sudo apt install"


def for_the_core() -> list[str]:
    """What is missing to build the core: a C++ compiler, or Python's headers."""
    missing = [] if any(map(shutil.which, ("c++", "g++", "clang++"))) else ["g++"]
    return missing if Path(sysconfig.get_path("include"), "Python.h").exists() else [*missing, "python3-dev"]


def main() -> None:
    if sys.argv[1:] == ["core"]:
        sys.exit(bool(for_the_core()))
    if sys.version_info < (3, 11):  # noqa: UP036 (this runs on whatever Python is there)
        sys.exit(f"Python {sys.version.split()[0]} is too old: 3.11 or newer is needed (make run PYTHON=python3.12)")
    if not Path(".venv/bin/python").exists() and not all(map(importlib.util.find_spec, ("venv", "ensurepip"))):
        sys.exit(f"Missing on this machine: python3-venv. {HOW} python3-venv")
    if missing := for_the_core():
        print(
            f"Missing on this machine: {', '.join(missing)}. It works without, but many times slower and so at a "
            f"smaller size:\nPyTorch draws instead of the C++ core. {HOW} {' '.join(missing)}\n"
            "Then the same command builds the core.",
            flush=True,
        )


if __name__ == "__main__":
    main()
