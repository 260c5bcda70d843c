"""Pairs of crops of one scene: a place cut in two ways, or with and without a cut, and attention checks.

The crops are those of the seam study (`seams.measure`): on level and hilly ground, near, at walker height and from
above, with a cut in the middle. Participants see a larger crop; the model observer judges its middle. Only cuts are
compared: across a border between tiles the patch does not change.
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
from dav_gswt.terrain import heights
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt_study.config import FLOOR
from dav_gswt_study.seams import crops, measure, places
from dav_gswt_study.seams.crops import Crop, RenderedCrop, View
from dav_gswt_study.seams.measure import GROUNDS
from dav_gswt_study.seams.placed_tiles import PlacedTiles
from dav_gswt_study.seams.places import Place

PLAIN, CHECK = "plain", "check"  # names in an attention check: the right answer and the wrong one
MAX_PLACES = 300  # places of a comparison that are tried in a setup
DARKENING = 0.6  # brightness of the replaced half of an attention check


@dataclass(frozen=True)
class Half:
    """One crop of a pair. shown: what the model observer judges; None without a seam."""

    name: str
    picture: Float32[Array, "h w 3"]
    shown: RenderedCrop | None = None


@dataclass(frozen=True)
class Item:
    """Two crops of a place. over: Seam-LPIPS of both over its floor; 0 without a seam, None if it was not measured."""

    halves: tuple[Half, Half]
    view: str
    ground: str
    cluster: str
    over: tuple[float | None, float | None] = (None, None)


@dataclass(frozen=True)
class Setup:
    """How crops are rendered: view, ground, width in pixels, and the tile sets on that ground."""

    view: View
    ground: str
    size: int
    placed: dict[str, tuple[PlacedTiles, EndlessTerrain]]


@dataclass(frozen=True)
class Spot:
    """A place to render: the crop that is judged, the crop that people see, and the patches of the former."""

    small: Crop
    large: Crop
    met: list[int]


def sample_pairs(sets: dict[str, PlacedTiles], asked: dict, weights: Weights | None) -> list[Item]:
    """All pairs of a scene. sets: its tile sets by tiling, of one layout. asked: the config's `perceptual_study`.

    The pairs of each comparison are distributed over the six setups (ground and view) in turn; no part of a tile is
    shown twice while others are left.
    Raises: InputError: too few places can be rendered.
    """
    setups, used, found = list(product(GROUNDS, crops.VIEWS)), set(), []
    side = next(iter(sets.values())).terrain.side
    for number, (ground, view) in enumerate(progress(setups, "draw pairs")):
        surface = heights.surface_from_config(GROUNDS[ground], side)
        placed = {name: (each, replace(each.terrain, heights=surface)) for name, each in sets.items()}
        look = Setup(view, ground, asked["size"], placed)
        rng = np.random.default_rng([asked["seed"], number])
        some = []
        for a, b in asked["pairs"]:
            some += _take_enough(
                _sample_comparison(look, a, b, used, rng), _count_for_setup(asked["crops"], number), f"{a} and {b}"
            )
        some += _take_enough(
            _sample_checks(look, used, rng), _count_for_setup(asked["checks"], number), "attention checks"
        )
        found += _measure_excess(look, some, weights, rng) if weights else some
    return found


def _count_for_setup(count: int, look: int) -> int:
    """How many of the crops a setup gets: every sixth."""
    return len(range(look, count, len(GROUNDS) * len(crops.VIEWS)))


def _take_enough(found: Iterator[Item], asked: int, what: str) -> list[Item]:
    some = list(islice(found, asked))
    if len(some) < asked:
        raise InputError(
            f"perceptual_study: only {len(some)} of {asked} crops of {what} could be rendered in one view: patches end "
            "inside a crop; choose a smaller `size` in the config's perceptual_study, or a finer preset"
        )
    return some


def _order_places(placed: PlacedTiles, used: set[str], rng: np.random.Generator) -> list[Place]:
    """Places on cuts, those of unused clusters first."""
    return sorted(places.sample_cuts(placed, rng), key=lambda place: place.cluster in used)[:MAX_PLACES]


def _sample_comparison(look: Setup, a: str, b: str, used: set[str], rng: np.random.Generator) -> Iterator[Item]:
    """Crops of the cuts of `a`, each with the nearest cut of `b` in the same tile, or the same ground without a cut."""
    for place in _order_places(look.placed[a][0], used, rng):
        halves = _pair_with_floor(look, a, place) if b == FLOOR else _pair_with_cut(look, a, b, place)
        if halves:
            used.add(place.cluster)
            yield Item(halves, look.view.name, look.ground, place.cluster)


def _pair_with_floor(look: Setup, name: str, place: Place) -> tuple[Half, Half] | None:
    """A crop of a cut, and the same ground with the patch that covers all of it."""
    spot = _find_spot(look, name, place)
    patch = _find_covering_patch(look.placed[name][0], spot) if spot else None
    if spot is None or patch is None or not (first := _render_cut(look, name, spot)):
        return None
    return first, _render_whole(look, name, spot, patch)


def _pair_with_cut(look: Setup, a: str, b: str, place: Place) -> tuple[Half, Half] | None:
    """A crop of a cut of `a`, and one of the nearest cut of `b`."""
    spot = _find_spot(look, a, place)
    nearest = places.find_nearest_cut(look.placed[b][0], place) if spot else None
    other = _find_spot(look, b, nearest) if nearest else None
    if spot is None or other is None or not (first := _render_cut(look, a, spot)):
        return None
    second = _render_cut(look, b, other)
    return (first, second) if second else None


def _find_spot(look: Setup, name: str, place: Place) -> Spot | None:
    """The crops of a cut before rendering; None where it cannot be judged."""
    placed, terrain = look.placed[name]
    if not (found := crops.find_cut(placed, terrain, look.view, place.at)):
        return None
    large = crops.make_crop(placed, terrain, look.view, place.at, look.size)
    return Spot(found[0], large, found[1]) if large else None


def _find_covering_patch(placed: PlacedTiles, spot: Spot) -> int | None:
    """The first of the patches that covers the whole crop."""
    return next((patch for patch in spot.met if crops.covers_crop(placed, spot.large, placed.origins[patch])), None)


def _render_cut(look: Setup, name: str, spot: Spot) -> Half | None:
    """A crop with a cut in its middle; None where objects hide it."""
    placed, terrain = look.placed[name]
    shown = crops.render_patches(placed, terrain, spot.small, spot.met)
    return Half(name, crops.render_crop(placed, terrain, spot.large), shown) if shown.shows_patch else None


def _render_whole(look: Setup, name: str, spot: Spot, patch: int) -> Half:
    """The crop with that patch alone."""
    placed, terrain = look.placed[name]
    changed = crops.mean_correction(placed, spot.small, patch)
    return Half(FLOOR, crops.render_patch(placed, terrain, spot.large, placed.origins[patch], changed))


def _sample_checks(look: Setup, used: set[str], rng: np.random.Generator) -> Iterator[Item]:
    """A crop, and half of it beside half of another place, which is darker: a straight edge that nobody overlooks."""
    name, (placed, terrain) = next(iter(look.placed.items()))
    before = None
    for place in _order_places(placed, used, rng):
        if not (large := crops.make_crop(placed, terrain, look.view, place.at, look.size)):
            continue
        picture = crops.render_crop(placed, terrain, large)
        if before is not None:
            used.add(place.cluster)
            halves = Half(PLAIN, picture), Half(CHECK, _replace_half(picture, before, upright=bool(rng.integers(2))))
            yield Item(halves, look.view.name, look.ground, place.cluster)
        before = picture


def _replace_half(
    picture: Float32[Array, "h w 3"], other: Float32[Array, "h w 3"], upright: bool
) -> Float32[Array, "h w 3"]:
    out = picture.copy()
    half = (slice(None), slice(out.shape[1] // 2, None)) if upright else (slice(out.shape[0] // 2, None),)
    out[half] = np.float32(DARKENING) * other[half]
    return out


def _measure_excess(look: Setup, items: list[Item], weights: Weights, rng: np.random.Generator) -> list[Item]:
    """The pairs with Seam-LPIPS of the middle of each crop over its floor.

    All tile sets share one bank of crops of the exemplar.
    """
    at, taken = [], []
    for i, item in enumerate(items):
        for k, half in enumerate(item.halves):
            if half.shown:
                at.append((i, k))
                taken.append(measure.SampledCrop("cut", i, item.cluster, half.shown))
    if not taken:
        return items
    seen = [each.shown.crop for each in taken]
    bank = measure.sample_exemplar_bank(*next(iter(look.placed.values())), seen, weights, rng)
    values = measure.compute_seam_lpips(taken, bank, weights)
    over = {place: own - floor for place, (own, floor) in zip(at, values, strict=True)}
    return [
        replace(item, over=tuple(over.get((i, k), _excess_without_seam(item.halves[k].name)) for k in (0, 1)))
        for i, item in enumerate(items)
    ]


def _excess_without_seam(name: str) -> float | None:
    return 0.0 if name == FLOOR else None
