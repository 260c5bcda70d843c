"""The kit: pairs of crops, trial lists, an offline page that hides which crop is which, and the key that tells.

The pairs of a scene are a folder that participants do not see: both crops as PNG, and pairs.json with their names.
In a trial list every pair comes once, in random order, and its first crop is on the left half of the time, at random.
The page knows only names made of digests. Whoever runs the study keeps the key, which says what they stand for.
"""

import hashlib
import json
import shutil
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dav_gswt.errors import InputError
from dav_gswt.files import atomic_folder, read_json, write_json
from dav_gswt.images import image_files
from dav_gswt_study.forced_choice.pairs import CHECK, Item

TABLE, TRIALS, PICTURES = "pairs.json", "trials.js", "pictures"
LISTS = 16  # list 2 n + 1 is list 2 n with left and right exchanged, in another order
FORMAT, VERSION = "davgswt-2afc-key", 1
SECONDS = 5.0  # for which a pair is shown, as in the paper

Trial = list[str]  # names of the pair, of the left picture and of the right picture


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
            pairs.append(names | seen)
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


def name_pictures(pairs: list[StoredPair], seed: int) -> dict[str, bytes]:
    """All pictures by their names; the same picture in two pairs has two."""
    pictures = (zip(_picture_names(pair, seed, k), pair.pictures, strict=True) for k, pair in enumerate(pairs))
    return {name: data for both in pictures for name, data in both}


def _picture_names(pair: StoredPair, seed: int, number: int) -> list[str]:
    return [_digest(seed, number, side, data)[:16] for side, data in enumerate(pair.pictures)]


def make_key(pairs: list[StoredPair], seed: int) -> dict:
    """The key: of each pair, by its name, what it is and its pictures' names, a's first; and the trial lists.

    `study` is a digest of all of it, so that answers to one kit are not taken for answers to another.
    """
    items = {}
    for k, pair in enumerate(pairs):
        names = {"pictures": _picture_names(pair, seed, k)}
        items[_digest(seed, k, *pair.pictures)[:12]] = pair.about | {"check": pair.check} | names
    items = dict(sorted(items.items()))
    lists = [trials for number in range(LISTS // 2) for trials in mirrored(items, seed, number)]
    key = {"format": FORMAT, "version": VERSION, "items": items, "lists": lists}
    return key | {"study": hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:16]}


def _digest(*parts: int | bytes) -> str:
    state = hashlib.sha256()
    for part in parts:
        data = part if isinstance(part, bytes) else str(part).encode()
        state.update(len(data).to_bytes(8, "little") + data)
    return state.hexdigest()


def mirrored(items: dict[str, dict], seed: int, number: int) -> tuple[list[Trial], list[Trial]]:
    """Two lists of all pairs: where one has a crop on the left, the other has it on the right.

    In each, every comparison's first crop is on the left half of the time (of an odd number, once more or less), and
    attention checks are spread: one in each of equal stretches.
    """
    rng = np.random.default_rng([seed, number])
    left = _sides(items, rng)
    lists = []
    for swapped in (False, True):
        trials = []
        for name in _order(items, rng):
            first, second = items[name]["pictures"]
            trials.append([name, first, second] if left[name] != swapped else [name, second, first])
        lists.append(trials)
    return tuple(lists)


def _sides(items: dict[str, dict], rng: np.random.Generator) -> dict[str, bool]:
    """Whether a pair's first crop is on the left."""
    groups = defaultdict(list)
    for name, item in items.items():
        groups[item["a"], item["b"]].append(name)
    out = {}
    for names in groups.values():
        more = int(rng.integers(2))  # where they are odd
        sides = np.arange(len(names)) % 2 == more
        out |= dict(zip(names, rng.permutation(sides).tolist(), strict=True))
    return out


def _order(items: dict[str, dict], rng: np.random.Generator) -> list[str]:
    checks, others = ([name for name in items if items[name]["check"] == kind] for kind in (True, False))
    checks, others = ([names[k] for k in rng.permutation(len(names))] for names in (checks, others))
    total = len(items)
    ends = [k * total // len(checks) for k in range(len(checks) + 1)] if checks else []
    places = [int(rng.integers(low, high)) for low, high in zip(ends, ends[1:], strict=False)]
    at, rest = dict(zip(places, checks, strict=True)), iter(others)
    return [at[k] if k in at else next(rest) for k in range(total)]


def write_kit(
    page: Path | str, key: Path | str, parts: Path, pairs: list[StoredPair], seed: int, seconds: float
) -> None:
    """Write the page's folder, which appears whole or not at all, and the key beside it.

    parts: the folder of the page's HTML, style and script. seconds: for which pictures are shown.
    The lists are a script, not JSON: a page that is opened as a file may run scripts, but not read files.
    Raises: InputError: there is no pair.
    """
    if not any(not pair.check for pair in pairs):
        raise InputError("forced_choice: there is no pair to show; ask for `pairs` and `crops`")
    answer_key = make_key(pairs, seed)
    with atomic_folder(page) as part:
        for path in sorted(parts.iterdir()):
            shutil.copyfile(path, part / path.name)
        (part / PICTURES).mkdir()
        # in the names' order, so that the files' times say nothing either
        for name, data in sorted(name_pictures(pairs, seed).items()):
            (part / PICTURES / f"{name}.png").write_bytes(data)
        study = {"study": answer_key["study"], "seconds": seconds, "lists": answer_key["lists"]}
        text = json.dumps(study, separators=(",", ":"), allow_nan=False)
        (part / TRIALS).write_text(f'"use strict";\nconst STUDY = {text};\n', encoding="utf-8")
    write_json(key, answer_key)
