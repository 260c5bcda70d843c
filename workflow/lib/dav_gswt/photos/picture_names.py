"""Names of the pictures that are made of photos."""

import re
from collections import Counter
from collections.abc import Sequence
from pathlib import PurePosixPath

from dav_gswt.images import image_files

UNSAFE = re.compile(r"[\s#]+")  # COLMAP's lists of images end a name at a blank and skip lines that begin with #


def split_name(name: str) -> tuple[str, str, str]:
    """Path without suffix, file name, stem. A suffix is that of a picture: a name may have other points in it."""
    path = PurePosixPath(name)
    bare = path.with_suffix("") if path.suffix.lower() in image_files.SUFFIXES and path.stem else path
    return str(bare), path.name, bare.name


def name_pictures(names: Sequence[str]) -> list[str]:
    """The PNG that is made of each photo: its stem; where two are equal the whole path, and a number if need be.

    Blanks and # become _, so that a name is one word in every list of images.
    """
    safe = [UNSAFE.sub("_", name) for name in names]
    stems = Counter(split_name(name)[2] for name in safe)
    out, used = [], set()
    for name in safe:
        stem = split_name(name)[2]
        plain = stem if stems[stem] == 1 else name.replace("/", "_").replace(".", "_")
        number, free = 1, plain
        while free in used:
            number, free = number + 1, f"{plain}_{number + 1}"
        used.add(free)
        out.append(f"{free}.png")
    return out
