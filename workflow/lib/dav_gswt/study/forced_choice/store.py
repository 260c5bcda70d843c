"""Pairs of a scene as a folder that nobody who takes part sees: both crops as PNG, and what they are in pairs.json."""

from dataclasses import dataclass
from pathlib import Path

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.images import image_files
from dav_gswt.study.forced_choice.pairs import CHECK, Item

TABLE = "pairs.json"


@dataclass(frozen=True)
class Drawn:
    """A pair that was drawn: what tells it from the others, and its crops' PNGs, a's first."""

    about: dict
    pictures: tuple[bytes, bytes]

    @property
    def check(self) -> bool:
        return self.about["b"] == CHECK

    @property
    def comparison(self) -> tuple[str, str]:
        return self.about["a"], self.about["b"]


def write(folder: Path | str, items: list[Item], origin: dict) -> None:
    """Write a scene's pairs; the folder appears whole or not at all. origin: its provenance."""
    with atomic_folder(folder) as part:
        told = []
        for number, item in enumerate(items):
            for letter, half in zip("ab", item.halves, strict=True):
                image_files.write_png(part / _name(number, letter), half.picture)
            names = dict(zip("ab", (half.name for half in item.halves), strict=True))
            seen = {"view": item.view, "ground": item.ground, "cluster": item.cluster}
            told.append(names | seen | {"over": list(item.over)})
        write_json(part / TABLE, {"pairs": told, "provenance": origin})


def read(folder: Path | str, scene: str) -> list[Drawn]:
    """What `write` wrote. Raises: InputError: a file is missing or not readable."""
    folder, found = Path(folder), []
    for number, about in enumerate(read_json(folder / TABLE)["pairs"]):
        try:
            pictures = tuple((folder / _name(number, letter)).read_bytes() for letter in "ab")
        except OSError as error:
            raise InputError(f"{error.filename}: not readable ({error.strerror}); draw the pairs again") from error
        found.append(Drawn({"scene": scene} | about, pictures))
    return found


def _name(number: int, letter: str) -> str:
    return f"{number:03d}_{letter}.png"
