"""One cell of the table of seams: crops of a tile set on level and on hilly ground, from near, walking and from above.

place: `border`, `cut`, `ceiling`: for each cut the one beside it of tiles laid without looking; `floor`: for each
crop the patches that meet in it, each laid whole over it and counted where the crop shows it (`likeness.floor`).
psnr: of the crop against a composite in which each pixel shows its own patch, laid whole: gaps, double layers and any
trace of a border cost. jump: RMS colour difference of neighbouring pixels across the seam over that inside the patches;
1 is no jump.
"""

import logging
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Float32, Int
from numpy import ndarray as Array

from dav_gswt.errors import InputError
from dav_gswt.images import metrics
from dav_gswt.images.lpips_weights import Weights
from dav_gswt.logs import progress
from dav_gswt.study.seams import crops, perceptual_distance, places
from dav_gswt.study.seams.crops import Crop, Shown, View
from dav_gswt.study.seams.ground import Laid
from dav_gswt.terrain import heights
from dav_gswt.terrain.endless import EndlessTerrain

_log = logging.getLogger(__name__)

BORDERS, CUTS = 64, 64  # crops of each, view and ground
LOOKED = 12 * BORDERS  # places of borders that are looked at for such crops as show no cut
BANK = 160  # crops of the exemplar in a view
COLUMNS = ("place", "view", "ground", "crop", "cluster", "seam_lpips", "psnr", "jump")
BEST = 80.0  # dB, of pictures that are as good as equal
GROUNDS = {"flat": {"kind": "flat"}, "hilly": {"kind": "hills", "height": 3.0, "wavelength": 20.0}}


@dataclass(frozen=True)
class Taken:
    """A crop that was taken: of which place, its number there, what of the seam it shows."""

    place: str
    number: int
    cluster: str
    shown: Shown


@dataclass(frozen=True)
class Bank:
    """Crops of the exemplar, and which of its cells each shows."""

    vectors: Float32[Array, "m d"]
    boxes: Int[Array, "m 2 2"]


def measured(laid: Laid, straight: Laid, weights: Weights | None, seed: int) -> list[dict]:
    """Rows of all crops: place, view, ground, crop, cluster, seam_lpips, psnr, jump; without weights no seam_lpips.

    straight: the tiles of the same exemplar and size that were laid without looking.
    Raises: InputError: fewer than half of the crops of a place can be taken.
    """
    if weights is None:
        _log.warning("crops are compared without LPIPS (config: lpips: none)")
    rows = []
    views = [(ground, view) for ground in GROUNDS for view in crops.VIEWS]
    for ground, view in progress(views, "measure seams"):
        surface = heights.surface_from_config(GROUNDS[ground], laid.terrain.side)
        draped, twin = (replace(each.terrain, heights=surface) for each in (laid, straight))
        rng = np.random.default_rng([seed, 7])
        taken = [*_borders(laid, draped, view, rng), *_cuts(laid, draped, (straight, twin), view, rng)]
        like = [(None, None)] * len(taken)
        if weights:
            seen = [each.shown.crop for each in taken]
            like = likeness_of(taken, exemplar_bank(laid, draped, seen, weights, rng), weights)
        for each, (own, floor) in zip(taken, like, strict=True):
            rows += [{key: row[key] for key in COLUMNS} for row in _rows(each, view.name, ground, own, floor)]
    return rows


def _borders(laid: Laid, terrain: EndlessTerrain, view: View, rng) -> list[Taken]:
    """First those that show a border alone, and then, if these are too few, some with a cut as well."""
    alone, others = [], []
    for place in places.borders(laid, rng)[:LOOKED]:
        if (crop := crops.crop(laid, terrain, view, place.at)) and (met := crops.meeting(laid, crop)):
            (others if len(met) > 1 else alone).append((place, crop, met))
    found = []
    for place, crop, met in alone + others:
        shown = crops.shown(laid, terrain, crop, met, border=True)
        if shown.any:
            found.append(Taken("border", len(found), place.cluster, shown))
        if len(found) == BORDERS:
            return found
    return _enough(found, BORDERS, "borders")


def _cuts(laid: Laid, terrain: EndlessTerrain, straight: tuple[Laid, EndlessTerrain], view: View, rng) -> list[Taken]:
    """Each cut and then its ceiling."""
    found = []
    for place in places.cuts(laid, rng):
        twin = places.beside(straight[0], place)
        pair = [(laid, terrain, place), (*straight, twin)] if twin else []
        both = [(who, on, crops.crop(who, on, view, there.at)) for who, on, there in pair]
        met = [crops.meeting(who, crop) if crop else None for who, _, crop in both]
        if met and all(patches and len(patches) > 1 for patches in met):  # else a seam ran beside the crop's middle
            number = BORDERS + len(found) // 2  # of the cut; its ceiling's is CUTS more
            cut, ceiling = (crops.shown(*each, patches) for each, patches in zip(both, met, strict=True))
            if cut.any and ceiling.any:
                found.append(Taken("cut", number, place.cluster, cut))
                found.append(Taken("ceiling", number + CUTS, place.cluster, ceiling))
        if len(found) == 2 * CUTS:
            return found
    return _enough(found, 2 * CUTS, "cuts")


def _enough(found: list[Taken], asked: int, what: str) -> list[Taken]:
    if len(found) < asked // 2:
        raise InputError(
            f"seams: only {len(found)} of {asked} crops of the tiles' {what} could be taken: patches do not meet, "
            "or end within what a crop shows; use a finer quality, or another `tile` and `strip` in the config's seams"
        )
    return found


def likeness_of(taken: list[Taken], bank: Bank, weights: Weights) -> Iterator[tuple[float, float]]:
    """Seam-LPIPS of every crop, and its floor: that of its patches, by their share. bank: of the view and ground."""
    pictures = [np.stack([each.shown.picture, *each.shown.own]) for each in taken]
    vectors, shapes = perceptual_distance.embedded(np.concatenate(pictures), weights)
    apart = perceptual_distance.distances(vectors, bank.vectors)
    ends = np.cumsum([len(some) for some in pictures])[:-1]
    for each, mine, far in zip(taken, np.split(vectors, ends), np.split(apart, ends), strict=True):
        near = perceptual_distance.nearest(far, perceptual_distance.apart_from(each.shown.sources, bank.boxes))
        like = [bank.vectors[chosen] for chosen in near[1:]]
        yield (
            float(far[0, near[0]].mean()),
            perceptual_distance.floor(mine[1:], like, perceptual_distance.where(each.shown.masks, shapes)),
        )


def exemplar_bank(
    laid: Laid, terrain: EndlessTerrain, seen: list[Crop], weights: Weights, rng: np.random.Generator
) -> Bank:
    """BANK crops of the exemplar, drawn at random, each laid under one of the crops in turn: on hills it has slopes
    as theirs.
    """
    pictures, boxes = [], []
    for k in range(BANK):
        crop = seen[k % len(seen)]
        low, high = -crop.box[0], laid.source.exemplar.cells - 1 - crop.box[1]  # of where its origin may not be beyond
        origin = -rng.integers(low, high + 1)
        pictures.append(crops.whole(laid, terrain, crop, origin, np.zeros(4)))
        boxes.append(crop.box - origin)
    return Bank(perceptual_distance.embedded(np.stack(pictures), weights)[0], np.stack(boxes))


def _rows(each: Taken, view: str, ground: str, own: float | None, floor: float | None) -> Iterator[dict]:
    """The crop's row and its floor's."""
    shown, about = each.shown, {"view": view, "ground": ground, "crop": each.number, "cluster": each.cluster}
    side = shown.tile if each.place == "border" else shown.patch
    known = shown.patch >= 0
    composite = np.take_along_axis(shown.own, np.maximum(shown.patch, 0)[None, ..., None], 0)[0]
    psnr = metrics.psnr(shown.picture, composite, known.astype(float))
    row = {"place": each.place} | about | {"seam_lpips": own, "psnr": min(psnr or BEST, BEST)}
    yield row | {"jump": jump(shown.picture, side, known)}
    jumps = [jump(picture, side, known) for picture in shown.own]
    mean = None if None in jumps else float(np.dot(jumps, shown.share))
    yield {"place": "floor"} | about | {"seam_lpips": floor, "psnr": None, "jump": mean}


def jump(picture: Float[Array, "h w 3"], side: Int[Array, "h w"], known: Bool[Array, "h w"]) -> float | None:
    """RMS colour difference of neighbouring pixels on two sides over that on one; None where either has no pair."""
    across, within = [], []
    for axis in (0, 1):
        colour, which, counted = (np.swapaxes(v, 0, axis) for v in (picture, side, known))
        counts = counted[1:] & counted[:-1]
        apart = ((colour[1:] - colour[:-1]).astype(float) ** 2).sum(-1)
        other = which[1:] != which[:-1]
        across.append(apart[counts & other])
        within.append(apart[counts & ~other])
    over, inside = (np.concatenate(pair) for pair in (across, within))
    if not (len(over) and len(inside) and inside.mean() > 0):
        return None
    return float(np.sqrt(over.mean() / inside.mean()))
