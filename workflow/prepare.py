"""Before anything is installed: is what the set-up needs on this machine? Names the package to install if not."""

import importlib.util
import shutil
import sys
import sysconfig
from pathlib import Path

missing = []
if sys.version_info < (3, 11):  # noqa: UP036 (this runs on whatever Python is there)
    sys.exit(f"Python {sys.version.split()[0]} is too old: 3.11 or newer is needed (make run PYTHON=python3.12)")
if not Path(".venv/bin/python").exists() and not all(map(importlib.util.find_spec, ("venv", "ensurepip"))):
    missing.append("python3-venv")
if not any(map(shutil.which, ("c++", "g++", "clang++"))):
    missing.append("g++")
if not Path(sysconfig.get_path("include"), "Python.h").exists():
    missing.append("python3-dev")
if missing:
    sys.exit(
        f"Missing on this machine: {', '.join(missing)}. On Debian or Ubuntu: sudo apt install {' '.join(missing)}"
    )
