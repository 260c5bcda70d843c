"""The variant of mitsuba that renders synthetic scenes, chosen once per process.

scalar_rgb runs wherever mitsuba does. llvm_ad_rgb compiles for the processor and needs a shared LLVM library, of which
some versions (14 and 15 among them) do not work or end the process, so each is first tried in a process of its own.

The environment variable DAV_GSWT_MITSUBA selects: `scalar` (default), `llvm`, or `auto` (llvm if it works). scalar
gives the same bytes every time, instances are free, and memory stays small. llvm takes a half to a third of the time
per picture, after compilation (3 s) and building the scene: a meadow of 16000 plants takes 40 s and 3.7 GB with llvm,
2 s and 0.8 GB with scalar.
"""

import logging
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

from dav_gswt.errors import InputError

_log = logging.getLogger(__name__)

VARIABLE = "DAV_GSWT_MITSUBA"
LIBRARY = "DRJIT_LIBLLVM_PATH"  # in which mitsuba finds the path of the LLVM library
CHOICES = ("scalar", "llvm", "auto")
PLACES = ("/usr/lib/llvm-*/lib", "/usr/lib/*-linux-gnu", "/usr/lib64", "/usr/lib64/llvm*/lib64", "/usr/local/lib")
TIMEOUT = 90.0  # seconds of one trial

# A white sky over grey ground, an instance: the light of every ray is 0.5. The mean over 16384 rays is within 0.01.
TRIAL = """
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
scene = mi.load_dict({
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 2},
    "sky": {"type": "constant"},
    "group": {"type": "shapegroup", "plane": {"type": "rectangle", "bsdf": grey}},
    "ground": {
        "type": "instance",
        "group": {"type": "ref", "id": "group"},
        "to_world": mi.ScalarTransform4f().scale(9.0),
    },
    "camera": {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}},
    },
})
print("mean", sum(mi.render(scene, spp=64).array) / (16 * 16 * 3))
"""


@dataclass(frozen=True)
class Variant:
    """A variant by mitsuba's name; for llvm also the library and its version."""

    name: str
    library: str | None = None
    llvm: int | None = None


def load_mitsuba():
    """mitsuba, with the chosen variant set."""
    choice = choose_variant()
    if choice.library:
        os.environ[LIBRARY] = choice.library  # read when the variant is set for the first time
    import mitsuba as mi

    if mi.variant() != choice.name:
        mi.set_variant(choice.name)
    return mi


def describe_renderer() -> dict[str, str | None]:
    """The versions of the renderer, for ground.json."""
    choice = choose_variant()
    llvm = None if choice.llvm is None else str(choice.llvm)
    return {"mitsuba": metadata.version("mitsuba"), "variant": choice.name, "llvm": llvm}


@cache
def choose_variant() -> Variant:
    """The variant of this process. Raises: InputError: an unknown choice, or llvm where no library works."""
    variant = os.environ.get(VARIABLE) or "scalar"
    if variant not in CHOICES:
        raise InputError(f"{VARIABLE}={variant}: choose from {', '.join(CHOICES)}")
    choice = Variant("scalar_rgb")
    if variant != "scalar":
        found = next((v for v in find_libraries() if check_library(v.library)), None)
        if found is None and variant == "llvm":
            raise InputError(f"{VARIABLE}=llvm: no LLVM library that works here; install one (Debian: libllvm19)")
        choice = found or choice
    llvm = f" with LLVM {choice.llvm}" if choice.llvm else ""
    _log.info("synthetic scenes are rendered by mitsuba's %s%s", choice.name, llvm)
    return choice


def find_libraries() -> list[Variant]:
    """LLVM libraries of this machine, newest first, after one that the environment names."""
    found = {}
    for place in (*PLACES, f"{sys.prefix}/lib".lstrip("/")):
        for path in Path("/").glob(place.lstrip("/") + "/libLLVM*.so*"):
            real = path.resolve()
            if (number := parse_version(real.name)) is not None and real.is_file():
                found[str(real)] = number
    given = os.environ.get(LIBRARY)
    first = [given] if given and Path(given).is_file() else []
    others = sorted((path for path in found if path not in first), key=lambda path: (-found[path], path))
    return [Variant("llvm_ad_rgb", path, parse_version(Path(path).resolve().name)) for path in first + others]


def parse_version(name: str) -> int | None:
    """The major version in the file name of a library: 14 of libLLVM-14.so.1, 19 of libLLVM.so.19.1."""
    match = re.fullmatch(r"libLLVM(?:-(\d+)(?:\.\d+)*)?\.so(?:\.(\d+)[\d.]*)?", name)
    number = (match[1] or match[2]) if match else None
    return int(number) if number else None


def check_library(library: str | None, trial: str = TRIAL, timeout: float = TIMEOUT) -> bool:
    """Whether a tiny picture is rendered correctly with a library, in a process that may crash or hang."""
    if library is None:
        return False
    try:
        done = subprocess.run(
            [sys.executable, "-c", trial],
            env=os.environ | {LIBRARY: library},
            capture_output=True,
            text=True,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired:
        _log.info("%s: did not answer in %g seconds", library, timeout)
        return False
    mean = re.search(r"^mean (\S+)$", done.stdout, re.MULTILINE)
    right = done.returncode == 0 and mean is not None and abs(float(mean[1]) - 0.5) < 0.01
    if not right:
        _log.info("%s: not used, as the trial picture went wrong (exit %d)", library, done.returncode)
    return right
