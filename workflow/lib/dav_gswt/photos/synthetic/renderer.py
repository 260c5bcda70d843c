"""Which of mitsuba's variants renders synthetic scenes: chosen once a process, and set in this one place.

scalar_rgb runs wherever mitsuba does. llvm_ad_rgb compiles for the processor and needs a shared LLVM library, of which
some versions (14 and 15 among them) do not work or end the process: each is tried in a process of its own first.

The environment variable DAV_GSWT_MITSUBA says which: `scalar` (if unset), `llvm`, or `auto` (llvm where it works). The
default is scalar: its pictures are the same bytes every time, instances cost it nothing, and its memory stays small.
llvm takes a half to a third of the time a picture, once it has compiled (3 s) and the scene is built: a meadow of 16000
plants takes 40 s and 3.7 GB there, 2 s and 0.8 GB here.
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
LIBRARY = "DRJIT_LIBLLVM_PATH"  # where mitsuba looks for the path of the LLVM library
CHOICES = ("scalar", "llvm", "auto")
PLACES = ("/usr/lib/llvm-*/lib", "/usr/lib/*-linux-gnu", "/usr/lib64", "/usr/lib64/llvm*/lib64", "/usr/local/lib")
PATIENCE = 90.0  # seconds that one trial may take

# A white sky over grey ground, an instance: every ray brings 0.5. The mean over 16384 rays is within 0.01 of it.
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


def use():
    """mitsuba, with the chosen variant set."""
    choice = chosen()
    if choice.library:
        os.environ[LIBRARY] = choice.library  # read when the variant is set for the first time
    import mitsuba as mi

    if mi.variant() != choice.name:
        mi.set_variant(choice.name)
    return mi


def described() -> dict:
    """What rendered, for ground.json."""
    choice = chosen()
    return {"mitsuba": metadata.version("mitsuba"), "variant": choice.name, "llvm": choice.llvm}


@cache
def chosen() -> Variant:
    """The variant of this process. Raises: InputError: an unknown choice, or llvm where no library works."""
    asked = os.environ.get(VARIABLE) or "scalar"
    if asked not in CHOICES:
        raise InputError(f"{VARIABLE}={asked}: choose from {', '.join(CHOICES)}")
    choice = Variant("scalar_rgb")
    if asked != "scalar":
        found = next((v for v in candidates() if works(v.library)), None)
        if found is None and asked == "llvm":
            raise InputError(f"{VARIABLE}=llvm: no LLVM library that works here; install one (Debian: libllvm19)")
        choice = found or choice
    llvm = f" with LLVM {choice.llvm}" if choice.llvm else ""
    _log.info("synthetic scenes are rendered by mitsuba's %s%s", choice.name, llvm)
    return choice


def candidates() -> list[Variant]:
    """LLVM libraries of this machine, newest first; before them the one that the environment already names."""
    found = {}
    for place in (*PLACES, f"{sys.prefix}/lib".lstrip("/")):
        for path in Path("/").glob(place.lstrip("/") + "/libLLVM*.so*"):
            real = path.resolve()
            if (number := version(real.name)) is not None and real.is_file():
                found[str(real)] = number
    given = os.environ.get(LIBRARY)
    first = [given] if given and Path(given).is_file() else []
    others = sorted((path for path in found if path not in first), key=lambda path: (-found[path], path))
    return [Variant("llvm_ad_rgb", path, version(Path(path).resolve().name)) for path in first + others]


def version(name: str) -> int | None:
    """The major version that a library's file name tells: 14 of libLLVM-14.so.1, 19 of libLLVM.so.19.1."""
    told = re.fullmatch(r"libLLVM(?:-(\d+)(?:\.\d+)*)?\.so(?:\.(\d+)[\d.]*)?", name)
    number = (told[1] or told[2]) if told else None
    return int(number) if number else None


def works(library: str, trial: str = TRIAL, patience: float = PATIENCE) -> bool:
    """Whether a tiny picture comes out right with a library, in a process that may crash or hang."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", trial],
            env=os.environ | {LIBRARY: library},
            capture_output=True,
            text=True,
            timeout=patience,
            check=False,
        )
    except subprocess.TimeoutExpired:
        _log.info("%s: did not answer in %g seconds", library, patience)
        return False
    told = re.search(r"^mean (\S+)$", done.stdout, re.MULTILINE)
    right = done.returncode == 0 and told is not None and abs(float(told[1]) - 0.5) < 0.01
    if not right:
        _log.info("%s: not used, as the trial picture went wrong (exit %d)", library, done.returncode)
    return right
