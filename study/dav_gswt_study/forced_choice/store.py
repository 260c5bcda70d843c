"""Pairs of a scene as a folder that participants do not see: both crops as PNG, and pairs.json with their names."""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.images import image_files
from dav_gswt_study.forced_choice.pairs import CHECK, Item

TABLE = "pairs.json"


@dataclass(frozen=True)
class StoredPair:
    """A pair: what it compares and where, and the PNGs of its crops, a's first."""

    about: dict
    pictures: tuple[bytes, bytes]

    @property
    def check(self) -> bool:
        return self.about["b"] == CHECK


def write_pairs(folder: Path | str, items: list[Item], origin: dict) -> None:
    """Write a scene's pairs; the folder appears whole or not at all. origin: its provenance."""
    with atomic_folder(folder) as part:
        pairs = []
        for number, item in enumerate(items):
            for letter, half in zip("ab", item.halves, strict=True):
                image_files.write_png(part / _picture_name(number, letter), half.picture)
            names = dict(zip("ab", (half.name for half in item.halves), strict=True))
            seen = {"view": item.view, "ground": item.ground, "cluster": item.cluster}
            pairs.append(names | seen | {"over": list(item.over)})
        write_json(part / TABLE, {"pairs": pairs, "provenance": origin})


def read_pairs(folder: Path | str, scene: str) -> list[StoredPair]:
    """Read the pairs of a scene. Raises: InputError: a file is missing or not readable."""
    folder, found = Path(folder), []
    for number, about in enumerate(read_json(folder / TABLE)["pairs"]):
        try:
            first, second = ((folder / _picture_name(number, letter)).read_bytes() for letter in "ab")
        except OSError as error:
            raise InputError(f"{error.filename}: not readable ({error.strerror}); draw the pairs again") from error
        found.append(StoredPair({"scene": scene} | about, (first, second)))
    return found


def _picture_name(number: int, letter: str) -> str:
    return f"{number:03d}_{letter}.png"
