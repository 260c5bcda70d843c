"""Before anything is installed: is what the set-up needs on this machine? Names the package to install if not.

With the argument `core` it says only by its exit code whether the rasterizer's C++ core can be built here.
It runs on whatever Python is there, 3.8 or newer, to say which one is needed.
"""

from __future__ import annotations

import ctypes
import importlib.util
import platform
import shutil
import sys
import sysconfig
from pathlib import Path

HOW = "On Debian or Ubuntu: sudo apt install"
PYTHONS = ((3, 11), (3, 12), (3, 13))  # for which all of requirements.lock is there


def explain_unsupported() -> str | None:
    """Why requirements.lock cannot be installed with this Python on this processor; None if it can."""
    version = platform.python_version()
    names = ["{}.{}".format(*known) for known in PYTHONS]
    if sys.version_info[:2] not in PYTHONS:
        found = f"Python {version} is too {'old' if sys.version_info[:2] < PYTHONS[0] else 'new'}"
        return f"{found}: {', '.join(names[:-1])} or {names[-1]} is needed (make run PYTHON=python{names[1]})"
    if sys.platform == "linux" and platform.machine() not in ("x86_64", "AMD64"):
        return f"Linux on {platform.machine()} is not supported: there is no pycolmap for it. Linux on x86_64 is."
    return None


def explain_unusable(folder: Path) -> str | None:
    """Why nothing can run in a folder of this name; None if it can. Snakemake calls Python by its plain path."""
    if odd := sorted(set(str(folder)) & set(" \t\n'\"\\$&;()<>|*?[]{}`!")):
        letters = " ".join("blanks" if letter == " " else letter for letter in odd)
        return f"{folder}: the path has {letters}, with which Snakemake starts no job: move or rename the folder"
    return None


def lacks_libatomic() -> bool:
    """Mitsuba, which renders the synthetic scenes, is the one wheel that needs a system library; g++ brings it."""
    try:
        ctypes.CDLL("libatomic.so.1")
    except OSError:
        return sys.platform == "linux"
    return False


def for_the_core() -> list[str]:
    """What is missing to build the core: a C++ compiler, or Python's headers."""
    missing = [] if any(map(shutil.which, ("c++", "g++", "clang++"))) else ["g++"]
    return missing if Path(sysconfig.get_path("include"), "Python.h").exists() else [*missing, "python3-dev"]


def main() -> None:
    if sys.argv[1:] == ["core"]:
        sys.exit(bool(for_the_core()))
    if refusal := explain_unsupported() or explain_unusable(Path.cwd()):
        sys.exit(refusal)
    needed = ["libatomic1"] if lacks_libatomic() else []
    if not Path(".venv/bin/python").exists() and not all(map(importlib.util.find_spec, ("venv", "ensurepip"))):
        needed.append("python3-venv")
    if needed:
        sys.exit(f"Missing on this machine: {', '.join(needed)}. {HOW} {' '.join(needed)}")
    if missing := for_the_core():
        print(
            f"Missing on this machine: {', '.join(missing)}. It works without, but many times slower and so at a "
            f"smaller size:\nPyTorch draws instead of the C++ core. {HOW} {' '.join(missing)}\n"
            "Then the same command builds the core.",
            flush=True,
        )


if __name__ == "__main__":
    main()
