"""Pairs of crops of one scene: the same place cut in two ways, or cut and whole, and some that nobody can mistake.

The crops are those of the seam study (`seams.measure`): on level and hilly ground, near, walking and from above, a cut
in the middle, drawn as the terrain is. People see more around it; what the model observer judges is the middle.
Cuts alone are shown: across a border between tiles the same patch goes on.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.study.config import FLOOR
from dav_gswt.study.seams import crops, measure, places
from dav_gswt.study.seams.crops import Crop, Shown, View
from dav_gswt.study.seams.ground import Laid
from dav_gswt.study.seams.measure import GROUNDS
from dav_gswt.study.seams.places import Place
from dav_gswt.terrain import heights
from dav_gswt.terrain.endless import EndlessTerrain

PLAIN, CHECK = "plain", "check"  # of an attention check: the right answer and the wrong one
TRIED = 300  # places of a comparison in a look, before there are too few
DARK = 0.6  # brightness of the half of a check that is not to be overlooked


@dataclass(frozen=True)
class Half:
    """One of the two. shown: what the model observer judges; None for what has no seam."""

    name: str
    picture: Float32[Array, "h w 3"]
    shown: Shown | None = None


@dataclass(frozen=True)
class Item:
    """Two crops of a place, and what is seen there. over: of both, Seam-LPIPS over its floor; 0 for what has no seam,
    None where it was not measured.
    """

    halves: tuple[Half, Half]
    view: str
    ground: str
    cluster: str
    over: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True)
class Look:
    """How crops are looked at: from where, over which ground, how many pixels wide; the tile sets laid over it."""

    view: View
    ground: str
    size: int
    laid: dict[str, tuple[Laid, EndlessTerrain]]


@dataclass(frozen=True)
class Spot:
    """A place that can be shown: what is judged, what people see, the patches that meet in the former."""

    small: Crop
    large: Crop
    met: list[int]


def drawn(sets: dict[str, Laid], asked: dict, weights: Weights | None) -> list[Item]:
    """All pairs of a scene. sets: its tile sets by their seams, of one layout. asked: the config's `perceptual_study`.

    The crops of each pair are dealt to the six looks (ground and view) in turn; no part of a tile is shown twice as
    long as there are others.
    Raises: InputError: too few places can be shown.
    """
    looks, used, found = list(product(GROUNDS, crops.VIEWS)), set(), []
    side = next(iter(sets.values())).terrain.side
    for number, (ground, view) in enumerate(progress(looks, "draw pairs")):
        surface = heights.surface_from_config(GROUNDS[ground], side)
        laid = {name: (each, replace(each.terrain, heights=surface)) for name, each in sets.items()}
        look = Look(view, ground, asked["size"], laid)
        rng = np.random.default_rng([asked["seed"], number])
        some = []
        for a, b in asked["pairs"]:
            some += _enough(_compared(look, a, b, used, rng), _dealt(asked["crops"], number), f"{a} and {b}")
        some += _enough(_checks(look, used, rng), _dealt(asked["checks"], number), "attention checks")
        found += _judged(look, some, weights, rng) if weights else some
    return found


def _dealt(count: int, look: int) -> int:
    """How many of the crops a look has: it and those six further on."""
    return len(range(look, count, len(GROUNDS) * len(crops.VIEWS)))


def _enough(found: Iterator[Item], asked: int, what: str) -> list[Item]:
    some = list(islice(found, asked))
    if len(some) < asked:
        raise InputError(
            f"perceptual_study: only {len(some)} of {asked} crops of {what} could be taken in one view: patches end "
            "within what a crop shows; ask for a smaller `size` in the config's perceptual_study, or a finer quality"
        )
    return some


def _fresh(laid: Laid, used: set[str], rng: np.random.Generator) -> list[Place]:
    """Some places on cuts: first those of clusters that were not shown."""
    return sorted(places.cuts(laid, rng), key=lambda place: place.cluster in used)[:TRIED]


def _compared(look: Look, a: str, b: str, used: set[str], rng: np.random.Generator) -> Iterator[Item]:
    """Crops of the cuts of `a`, each beside the nearest cut of `b` in the same tile, or the same ground whole."""
    for place in _fresh(look.laid[a][0], used, rng):
        if not (spot := _spot(look, a, place)):
            continue
        twin = None if b == FLOOR else places.beside(look.laid[b][0], place)
        other = _covering(look.laid[a][0], spot) if b == FLOOR else twin and _spot(look, b, twin)
        if other is None or not (first := _cut(look, a, spot)):
            continue
        if second := _whole(look, a, spot, other) if b == FLOOR else _cut(look, b, other):
            used.add(place.cluster)
            yield Item((first, second), look.view.name, look.ground, place.cluster)


def _spot(look: Look, name: str, place: Place) -> Spot | None:
    """Where a cut can be looked at, before anything is drawn; None where it cannot be judged."""
    laid, terrain = look.laid[name]
    small = crops.crop(laid, terrain, look.view, place.at)
    met = crops.meeting(laid, small) if small else None
    large = crops.crop(laid, terrain, look.view, place.at, look.size) if met and len(met) > 1 else None
    return Spot(small, large, met) if large else None


def _covering(laid: Laid, spot: Spot) -> int | None:
    """The first of the patches that can be laid whole over all that the crop shows."""
    return next((patch for patch in spot.met if crops.inside(laid, spot.large, laid.origins[patch])), None)


def _cut(look: Look, name: str, spot: Spot) -> Half | None:
    """A crop with a cut in its middle; None where things that stand hide it."""
    laid, terrain = look.laid[name]
    shown = crops.shown(laid, terrain, spot.small, spot.met)
    return Half(name, crops.picture(laid, terrain, spot.large), shown) if shown.any else None


def _whole(look: Look, name: str, spot: Spot, patch: int) -> Half:
    """The crop with that patch laid whole."""
    laid, terrain = look.laid[name]
    changed = crops.change(laid, spot.small, patch)
    return Half(FLOOR, crops.whole(laid, terrain, spot.large, laid.origins[patch], changed))


def _checks(look: Look, used: set[str], rng: np.random.Generator) -> Iterator[Item]:
    """A crop, and half of it beside half of another place, which is darker: a straight edge that nobody overlooks."""
    name, (laid, terrain) = next(iter(look.laid.items()))
    before = None
    for place in _fresh(laid, used, rng):
        if not (large := crops.crop(laid, terrain, look.view, place.at, look.size)):
            continue
        picture = crops.picture(laid, terrain, large)
        if before is not None:
            used.add(place.cluster)
            halves = Half(PLAIN, picture), Half(CHECK, _spoilt(picture, before, upright=bool(rng.integers(2))))
            yield Item(halves, look.view.name, look.ground, place.cluster)
        before = picture


def _spoilt(picture: Float32[Array, "h w 3"], other: Float32[Array, "h w 3"], upright: bool) -> Float32[Array, "h w 3"]:
    out = picture.copy()
    half = (slice(None), slice(out.shape[1] // 2, None)) if upright else (slice(out.shape[0] // 2, None),)
    out[half] = np.float32(DARK) * other[half]
    return out


def _judged(look: Look, items: list[Item], weights: Weights, rng: np.random.Generator) -> list[Item]:
    """The items with how much farther the middle of each crop is from the exemplar than its patches are.

    One bank of the exemplar's crops serves all tile sets, so that both of a pair are compared with the same.
    """
    at = [(i, k) for i, item in enumerate(items) for k in (0, 1) if item.halves[k].shown]
    taken = [measure.Taken("cut", i, items[i].cluster, items[i].halves[k].shown) for i, k in at]
    if not taken:
        return items
    seen = [each.shown.crop for each in taken]
    bank = measure.exemplar_bank(*next(iter(look.laid.values())), seen, weights, rng)
    values = measure.likeness_of(taken, bank, weights)
    over = {place: own - floor for place, (own, floor) in zip(at, values, strict=True)}
    return [
        replace(item, over=tuple(over.get((i, k), _seamless(item.halves[k].name)) for k in (0, 1)))
        for i, item in enumerate(items)
    ]


def _seamless(name: str) -> float | None:
    return 0.0 if name == FLOOR else None
