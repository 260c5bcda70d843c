"""The search: a corner, strips cut against it, centres cut against their frames, each for what lies fast already."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.logs import progress
from dav_gswt.tiles import cuts, layout, patches
from dav_gswt.tiles.layout import CENTRE, EDGES, Layout, Places


@dataclass(frozen=True)
class Sketch:
    """An exemplar as the search sees it: cuts use its colours under one frozen pair of scales."""

    plan: Layout
    guide: patches.Guide
    colour: Float[Array, "m m c"]
    gradient: Float[Array, "m m 2"]
    unit: cuts.Scales
    candidates: int
    tries: int

    def cut(self, first: tuple, second: tuple, keep: Bool[Array, "h w"], take: Bool[Array, "h w"]) -> cuts.Cut:
        """Cut two patches, given by the exemplar's cells (rows, columns) they show. keep, take: forced to either."""
        a, b = (self.colour[where] for where in (first, second))
        g, h = (self.gradient[where] for where in (first, second))
        return cuts.cut(*cuts.weights(a, b, g, h, self.unit), keep, take)


@dataclass(frozen=True)
class Found:
    """Places and cuts. vertical, horizontal: by colour, where the corner lies in a strip; energies of all cuts."""

    places: Places
    vertical: Bool[Array, "2 n w"]
    horizontal: Bool[Array, "2 w n"]
    labels: UInt8[Array, "tiles n n"]
    strip_energy: list[float]
    tile_energy: list[float]

    def record(self) -> dict:
        """What was chosen and what it cost, as JSON; strips are vertical 0, 1, then horizontal 0, 1."""
        names = ("corner", "vertical", "horizontal", "centres")
        places = {name: getattr(self.places, name).tolist() for name in names}
        return {"places": places, "strip_energy": self.strip_energy, "tile_energy": self.tile_energy}


def sketch(plan: Layout, guide: patches.Guide, colour: Float[Array, "m m c"], candidates: int, tries: int) -> Sketch:
    return Sketch(plan, guide, colour, cuts.gradients(colour), cuts.scales(colour), candidates, tries)


def search(sketch: Sketch, variants: int, rng: np.random.Generator) -> Found:
    """All places and cuts of 16 `variants` tiles."""
    corner = patches.blandest(sketch.guide, sketch.plan)
    used = [(corner, (2 * sketch.plan.corner, 2 * sketch.plan.corner))]
    upright, flat = (_strips(sketch, corner, way, used, rng) for way in (True, False))
    sides = [[place for place, _ in pair] for pair in (upright, flat)]
    masks = [np.stack([~seam.labels for _, seam in pair]) for pair in (upright, flat)]
    places = Places(corner, *(np.stack(s) for s in sides), np.zeros((EDGES * variants, 2), int))
    centres = _centres(sketch, places, masks, rng)
    return Found(
        Places(places.corner, places.vertical, places.horizontal, np.stack([place for place, *_ in centres])),
        *masks,
        np.stack([labels for _, labels, _ in centres]),
        [seam.energy for _, seam in upright + flat],
        [energy for *_, energy in centres],
    )


def _strips(sketch: Sketch, corner: Array, upright: bool, used: list, rng) -> list[tuple[Array, cuts.Cut]]:
    """Two strips of one direction, each with its cut against the corner patch; they join the patches `used`."""
    plan = sketch.plan
    n, b, a = plan.side, plan.strip, plan.corner
    size = (2 * b, n) if upright else (n, 2 * b)
    y, x = np.mgrid[: size[1], : size[0]]
    along = y if upright else x
    keep = (along < b) | (along >= n - b)
    take = (along >= a) & (along < n - a)
    ends = np.where(along < n // 2, 1, 2)
    shift = layout.strip_shifts(plan, np.zeros(2, int), corner, upright)
    shown = tuple(np.clip(v, 0, plan.exemplar - 1) for v in layout.sources(ends, shift))
    zone = _end_lines(plan, upright)
    places = patches.sure(sketch.guide, patches.candidates(plan, size, sketch.candidates, rng), size)
    cost = patches.mismatch(sketch.guide, zone, tuple(v[zone] for v in shown), places)
    odd = patches.means(patches.oddness(sketch.guide), places, size)
    fits = np.intersect1d(patches.fitting(cost), patches.fitting(odd))
    if len(fits) > 1:  # else the best of both is all there is to choose from
        places, cost, odd = places[fits], cost[fits], odd[fits]
    cost = patches.relative(cost) + patches.relative(odd)
    found = []
    for _ in range(2):
        taken = np.array([place for place, _ in found], int).reshape(-1, 2)
        order = patches.ranked(places, cost, size, used, taken)
        found.append(_best(sketch, shown, order, keep, take))
    used += [(place, size) for place, _ in found]
    return found


def _centres(sketch: Sketch, places: Places, masks: list, rng) -> list[tuple[Array, Array, float]]:
    """A centre for every tile: place, label map, energy."""
    plan = sketch.plan
    n, b = plan.side, plan.strip
    y, x = np.mgrid[:n, :n]
    depth = np.minimum(np.minimum(x, n - 1 - x), np.minimum(y, n - 1 - y))
    keep, take = depth < plan.block, depth >= b
    zone = _ring_lines(plan)
    size = (n, n)
    choice = patches.sure(sketch.guide, patches.candidates(plan, size, sketch.candidates, rng), size)
    found = []
    for tile in progress(range(len(places.centres)), "cut tiles"):
        west, north, east, south = layout.colours(tile)
        around = layout.frame(plan, *masks, tile)
        shift = layout.offsets(plan, places, tile)
        # inside, where the centre is forced, the frame shows anything
        shown = tuple(np.clip(v, 0, plan.exemplar - 1) for v in layout.sources(around, shift))
        cost = patches.mismatch(sketch.guide, zone, tuple(v[zone] for v in shown), choice)
        fits = patches.fitting(cost)
        cost = patches.relative(cost[fits])
        beside = [(places.vertical[c], (2 * b, n)) for c in sorted({west, east})]
        beside += [(places.horizontal[c], (n, 2 * b)) for c in sorted({south, north})]
        taken = np.array([place for place, *_ in found], int).reshape(-1, 2)
        order = patches.ranked(choice[fits], cost, size, beside, taken)
        variants = {
            tuple(place) for place, *_ in found[tile % EDGES :: EDGES]
        }  # of the same edges: a centre of its own
        order = np.array([place for place in order if tuple(place) not in variants] or order)
        place, seam = _best(sketch, shown, order, keep, take)
        found.append((place, np.where(seam.labels, CENTRE, around).astype(np.uint8), seam.energy))
    return found


def _end_lines(plan: Layout, upright: bool) -> tuple[Array, Array]:
    """Cells [line, cell] along a strip where it may be cut against the corner patch: a line a cell of its width,
    twice.
    """
    across = np.tile(np.arange(2 * plan.strip), 2)[:, None]
    depth = np.arange(plan.strip, plan.corner)
    along = np.concatenate([np.tile(depth, (2 * plan.strip, 1)), np.tile(plan.side - 1 - depth, (2 * plan.strip, 1))])
    across = np.broadcast_to(across, along.shape)
    return (along, across) if upright else (across, along)


def _ring_lines(plan: Layout) -> tuple[Array, Array]:
    """Cells [line, cell] from a tile's border inwards where its centre may be cut: a line a cell of every side."""
    n = plan.side
    depth = np.tile(np.arange(plan.block, plan.strip), (n, 1))
    along = np.broadcast_to(np.arange(n)[:, None], depth.shape)
    y = np.concatenate([along, along, depth, n - 1 - depth])
    x = np.concatenate([depth, n - 1 - depth, along, along])
    return y, x


def _best(sketch: Sketch, shown: tuple, order: Int[Array, "n 2"], keep, take) -> tuple[Array, cuts.Cut]:
    """Of the first `tries` places the one whose seam is cheapest."""
    y, x = np.mgrid[: keep.shape[0], : keep.shape[1]]
    seams = [(place, sketch.cut(shown, (y + place[1], x + place[0]), keep, take)) for place in order[: sketch.tries]]
    return min(seams, key=lambda found: found[1].energy)
