"""Trial lists: every pair once, in random order, and which crop is on the left at random but half of the time.

What the page knows is names made of digests. What they stand for is in the key, which stays with who runs the study.
"""

import hashlib
import json
from collections import defaultdict

import numpy as np

from dav_gswt_study.forced_choice.store import StoredPair

LISTS = 16  # list 2 n + 1 is list 2 n with left and right exchanged, in another order
FORMAT, VERSION = "davgswt-2afc-key", 1
SECONDS = 5.0  # for which a pair is shown, as in the paper

Trial = list[str]  # the pair's name, and those of the pictures on the left and on the right


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
