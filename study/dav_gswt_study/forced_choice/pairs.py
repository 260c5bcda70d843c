"""Pairs of crops of one scene: a place cut in two ways, or with and without a cut, and attention checks.

The crops are those of the seam study (`seams.measure`): on level and hilly ground, near, at walker height and from
above, with a cut in the middle, but larger. Only cuts are compared: across a border between tiles the patch does not
change.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice, product

import numpy as np
from jaxtyping import Float32
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.logs import progress
from dav_gswt.terrain import heights
from dav_gswt.terrain.endless import EndlessTerrain
from dav_gswt_study.config import FLOOR
from dav_gswt_study.seams import crops, places
from dav_gswt_study.seams.crops import Crop, View
from dav_gswt_study.seams.measure import GROUNDS
from dav_gswt_study.seams.placed_tiles import PlacedTiles
from dav_gswt_study.seams.places import Place

PLAIN, CHECK = "plain", "check"  # names in an attention check: the right answer and the wrong one
MAX_PLACES = 300  # places of a comparison that are tried in a setup
DARKENING = 0.6  # brightness of the replaced half of an attention check


@dataclass(frozen=True)
class Half:
    """One crop of a pair."""

    name: str
    picture: Float32[Array, "h w 3"]


@dataclass(frozen=True)
class Item:
    """Two crops of a place."""

    halves: tuple[Half, Half]
    view: str
    ground: str
    cluster: str


@dataclass(frozen=True)
class Setup:
    """How crops are rendered: view, ground, width in pixels, and the tile sets on that ground."""

    view: View
    ground: str
    size: int
    placed: dict[str, tuple[PlacedTiles, EndlessTerrain]]


def sample_pairs(sets: dict[str, PlacedTiles], asked: dict) -> list[Item]:
    """All pairs of a scene. sets: its tile sets by tiling, of one layout. asked: the config's `forced_choice`.

    The pairs of each comparison are distributed over the six setups (ground and view) in turn; no part of a tile is
    shown twice while others are left.
    Raises: InputError: too few places can be rendered.
    """
    setups, used, found = list(product(GROUNDS, crops.VIEWS)), set(), []
    side = next(iter(sets.values())).terrain.side
    for number, (ground, view) in enumerate(progress(setups, "draw pairs")):
        surface = heights.surface_from_config(GROUNDS[ground], side, 1.0)
        placed = {name: (each, replace(each.terrain, heights=surface)) for name, each in sets.items()}
        look = Setup(view, ground, asked["size"], placed)
        rng = np.random.default_rng([asked["seed"], number])
        crops_here, checks_here = (_count_for_setup(asked[kind], number) for kind in ("crops", "checks"))
        for a, b in asked["pairs"]:
            found += _take_enough(_sample_comparison(look, a, b, used, rng), crops_here, f"{a} and {b}")
        found += _take_enough(_sample_checks(look, used, rng), checks_here, "attention checks")
    return found


def _count_for_setup(count: int, look: int) -> int:
    """How many of the crops a setup gets: every sixth."""
    return len(range(look, count, len(GROUNDS) * len(crops.VIEWS)))


def _take_enough(found: Iterator[Item], asked: int, what: str) -> list[Item]:
    some = list(islice(found, asked))
    if len(some) < asked:
        raise InputError(
            f"forced_choice: only {len(some)} of {asked} crops of {what} could be rendered in one view: patches end "
            "inside a crop; choose a smaller `size` in the config's forced_choice, or a finer preset"
        )
    return some


def _order_places(placed: PlacedTiles, used: set[str], rng: np.random.Generator) -> list[Place]:
    """Places on cuts, those of unused clusters first."""
    return sorted(places.sample_cuts(placed, rng), key=lambda place: place.cluster in used)[:MAX_PLACES]


def _sample_comparison(look: Setup, a: str, b: str, used: set[str], rng: np.random.Generator) -> Iterator[Item]:
    """Crops of the cuts of `a`, each with the nearest cut of `b` in the same tile, or the same ground without a cut."""
    for place in _order_places(look.placed[a][0], used, rng):
        second = _render_floor(look, a, place) if b == FLOOR else _render_nearest(look, b, place)
        if second and (first := _render_cut(look, a, place)):
            used.add(place.cluster)
            yield Item((first, second), look.view.name, look.ground, place.cluster)


def _find_crops(look: Setup, name: str, place: Place) -> tuple[Crop, list[int], Crop] | None:
    """The crop of a cut that the seam study judges, its patches, and the crop that is shown; None where none can be."""
    placed, terrain = look.placed[name]
    cut = crops.find_cut(placed, terrain, look.view, place.at)
    large = crops.make_crop(placed, terrain, look.view, place.at, look.size)
    return (*cut, large) if cut and large else None


def _render_cut(look: Setup, name: str, place: Place) -> Half | None:
    """A crop with a cut in its middle; None where it cannot be judged, or objects hide it."""
    placed, terrain = look.placed[name]
    if not (found := _find_crops(look, name, place)):
        return None
    crop, patches, large = found
    visible = crops.render_patches(placed, terrain, crop, patches).shows_patch
    return Half(name, crops.render_crop(placed, terrain, large)) if visible else None


def _render_nearest(look: Setup, name: str, place: Place) -> Half | None:
    """A crop of another tiling's cut that is nearest to a place."""
    nearest = places.find_nearest_cut(look.placed[name][0], place)
    return _render_cut(look, name, nearest) if nearest else None


def _render_floor(look: Setup, name: str, place: Place) -> Half | None:
    """The crop of a cut as its first patch that covers all of it."""
    placed, terrain = look.placed[name]
    if not (found := _find_crops(look, name, place)):
        return None
    crop, patches, large = found
    for patch in patches:
        if crops.covers_crop(placed, large, placed.origins[patch]):
            change = crops.mean_correction(placed, crop, patch)
            return Half(FLOOR, crops.render_patch(placed, terrain, large, placed.origins[patch], change))
    return None


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
