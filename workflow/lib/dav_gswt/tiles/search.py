"""The search: a corner, strips cut against it, centres cut against their frames, each for what lies fast already."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.logs import progress
from dav_gswt.tiles import cuts, expansion, layout, patches, repetition
from dav_gswt.tiles.energy import SeamEnergy, compute_edge_costs
from dav_gswt.tiles.layout import CENTRE, EDGES, LABELS, Layout, PatchPlaces

MIN_FITTING = 4  # times as many places as are tried: among fewer there is no choice
MAX_PAIRED = 200  # strips, at most, of which every two are looked at together
REPETITION_COST = 2.0  # charge for what comes back with every tile, where a median seam costs 1


@dataclass(frozen=True)
class SearchProblem:
    """An exemplar as the search sees it: places by the guide, cuts by the energy."""

    plan: Layout
    guide: patches.GuidanceMaps
    energy: SeamEnergy
    candidates: int
    tries: int

    def gamma(self, place: Int[Array, "2"], size: tuple[int, int]) -> float:
        """Weight of colour in the seams of a patch: by its mean uncertainty."""
        return self.energy.gamma(float(patches.patch_means(self.guide.uncertainty, place[None], size)[0]))

    def cut(self, first: tuple, second: tuple, gamma: float, zone: cuts.OverlapZone) -> cuts.Cut:
        """Cut two patches, given by the exemplar's cells (rows, columns) that they show."""
        costs = compute_edge_costs(self.energy.terms(gamma), first, second)
        if self.energy.kind == "none":
            return cuts.price_cut(*costs, zone.straight)
        return cuts.find_cut(*costs, zone.keep, zone.take)


@dataclass(frozen=True)
class PlacedPatch:
    """A patch in its place, what its seam looks like, and the weight that colour had in it."""

    place: Int[Array, "2"]
    seam: cuts.Cut
    gamma: float


@dataclass(frozen=True)
class CutTile:
    """A tile's label map. expanded: what alpha-expansion did to it, as JSON, where it was asked for."""

    centre: PlacedPatch
    labels: UInt8[Array, "n n"]
    expanded: dict | None


@dataclass(frozen=True)
class SearchResult:
    """Places and cuts. vertical, horizontal: by colour, where the corner lies in a strip. strips: vertical 0, 1, then
    horizontal 0, 1.
    """

    places: PatchPlaces
    vertical: Bool[Array, "2 n w"]
    horizontal: Bool[Array, "2 w n"]
    strips: list[PlacedPatch]
    tiles: list[CutTile]

    @property
    def labels(self) -> UInt8[Array, "tiles n n"]:
        return np.stack([tile.labels for tile in self.tiles])

    def describe(self) -> dict:
        """What was chosen and what it cost, as JSON; strips are vertical 0, 1, then horizontal 0, 1."""
        names = ("corner", "vertical", "horizontal", "centres")
        out = {
            "places": {name: getattr(self.places, name).tolist() for name in names},
            "strip_energy": [strip.seam.energy for strip in self.strips],
            "strip_gamma": [strip.gamma for strip in self.strips],
            "tile_energy": [tile.centre.seam.energy for tile in self.tiles],
            "tile_gamma": [tile.centre.gamma for tile in self.tiles],
        }
        expanded = [tile.expanded for tile in self.tiles if tile.expanded]
        return out | ({"expansion": expanded} if expanded else {})


def search_patches(sketch: SearchProblem, variants: int, rng: np.random.Generator) -> SearchResult:
    """All places and cuts of 16 `variants` tiles."""
    corner = patches.find_least_salient(sketch.guide, sketch.plan)
    used = [(corner, (2 * sketch.plan.corner, 2 * sketch.plan.corner))]
    upright, flat = (_search_strips(sketch, corner, way, used, rng) for way in (True, False))
    sides = [np.stack([strip.place for strip in pair]) for pair in (upright, flat)]
    masks = [np.stack([~strip.seam.labels for strip in pair]) for pair in (upright, flat)]
    places = PatchPlaces(corner, *sides, np.zeros((EDGES * variants, 2), int))
    tiles = _search_centres(sketch, places, masks, rng)
    places = PatchPlaces(corner, *sides, np.stack([tile.centre.place for tile in tiles]))
    return SearchResult(places, *masks, upright + flat, tiles)


def _search_strips(sketch: SearchProblem, corner: Array, upright: bool, used: list, rng) -> list[PlacedPatch]:
    """Two strips of one direction, each with its cut against the corner patch; they join the patches `used`."""
    plan = sketch.plan
    n, b, a = plan.side, plan.strip, plan.corner
    size = (2 * b, n) if upright else (n, 2 * b)
    y, x = np.mgrid[: size[1], : size[0]]
    along = y if upright else x
    depth = np.minimum(along, n - 1 - along)
    ends_at = (a + b) // 2  # where a cut without looking lies, and the others about there
    free = cuts.OverlapZone(depth < b, depth >= a, depth >= ends_at)
    ends = np.where(along < n // 2, 1, 2)
    shift = layout.strip_shifts(plan, np.zeros(2, int), corner, upright)
    shown = tuple(np.clip(v, 0, plan.exemplar - 1) for v in layout.source_cells(ends, shift))
    zone = _end_lines(plan, upright)
    places = patches.keep_certain(sketch.guide, patches.draw_candidates(plan, size, sketch.candidates, rng), size)
    cost = patches.compute_mismatch(sketch.guide, zone, tuple(v[zone] for v in shown), places)
    odd = patches.patch_saliency(sketch.guide, places, size)
    fits = np.intersect1d(patches.find_fitting(cost), patches.find_fitting(odd))
    cost = patches.divide_by_median(cost) + patches.divide_by_median(odd)
    if len(fits) < MIN_FITTING * sketch.tries:  # the best of both is all there is to choose from
        fits = np.argsort(cost, kind="stable")[: MIN_FITTING * sketch.tries]
    fits = fits[np.argsort(cost[fits], kind="stable")[:MAX_PAIRED]]
    places, cost = places[fits], cost[fits]
    seen = repetition.start_overlay(sketch.guide.features[..., :3], n, size, fast=(depth < ends_at, shown))
    pairs = patches.rank_pairs(places, cost, REPETITION_COST * seen.pair_costs(places), size, used)[: sketch.tries]
    laid = [[_place_patch(sketch, shown, place, size, free) for place in pair] for pair in pairs]
    found = min(laid, key=lambda strips: sum(strip.seam.energy for strip in strips))
    used += [(strip.place, size) for strip in found]
    return found


def _search_centres(sketch: SearchProblem, places: PatchPlaces, masks: list, rng) -> list[CutTile]:
    """Every tile with a centre of its own."""
    plan = sketch.plan
    n, b = plan.side, plan.strip
    y, x = np.mgrid[:n, :n]
    depth = np.minimum(np.minimum(x, n - 1 - x), np.minimum(y, n - 1 - y))
    frame = (plan.block + b) // 2  # how wide it is where a cut does not look
    free = cuts.OverlapZone(depth < plan.block, depth >= b, depth >= frame)
    zone = _ring_lines(plan)
    size = (n, n)
    choice = patches.keep_certain(sketch.guide, patches.draw_candidates(plan, size, sketch.candidates, rng), size)
    seen = repetition.start_overlay(sketch.guide.features[..., :3], n, size, (frame, frame))
    found = []
    for tile in progress(range(len(places.centres)), "cut tiles"):
        west, north, east, south = layout.edge_colours(tile)
        around = layout.frame_labels(plan, *masks, tile)
        shift = layout.label_shifts(plan, places, tile)
        # inside, where the centre is forced, the frame shows anything
        shown = tuple(np.clip(v, 0, plan.exemplar - 1) for v in layout.source_cells(around, shift))
        cost = patches.compute_mismatch(sketch.guide, zone, tuple(v[zone] for v in shown), choice)
        fits = patches.find_fitting(cost)
        cost = patches.divide_by_median(cost[fits]) + REPETITION_COST * seen.cost_of(choice[fits])
        beside = [(places.vertical[c], (2 * b, n)) for c in sorted({west, east})]
        beside += [(places.horizontal[c], (n, 2 * b)) for c in sorted({south, north})]
        taken = np.array([tile.centre.place for tile in found], int).reshape(-1, 2)
        order = patches.rank_places(choice[fits], cost, size, beside, taken)
        variants = {tuple(other.centre.place) for other in found[tile % EDGES :: EDGES]}  # a centre of its own
        order = np.array([place for place in order if tuple(place) not in variants] or order)
        centre = _place_best(sketch, shown, order, size, free)
        labels = np.where(centre.seam.labels, CENTRE, around).astype(np.uint8)
        shift[CENTRE] = centre.place
        found.append(_expanded(sketch, centre, labels, shift))
        seen = seen.with_patch(centre.place)
    return found


def _expanded(
    sketch: SearchProblem, centre: PlacedPatch, labels: UInt8[Array, "n n"], shift: Int[Array, "9 2"]
) -> CutTile:
    """The tile; where expansion is asked for, all its patches are expanded from the exact cuts on."""
    if sketch.energy.kind != "expansion":
        return CutTile(centre, labels, None)
    whole = [np.full(labels.shape, label) for label in range(len(LABELS))]
    # where a patch may not lie, it shows anything
    shown = np.stack([np.clip(layout.source_cells(one, shift), 0, sketch.plan.exemplar - 1) for one in whole], 1)
    found = expansion.expand_labels(
        labels, expansion.Patches(*shown, layout.allowed_cells(sketch.plan)), sketch.energy.terms(centre.gamma)
    )
    return CutTile(centre, found.labels, found.describe())


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


def _place_best(
    sketch: SearchProblem, shown: tuple, order: Int[Array, "n 2"], size: tuple[int, int], zone: cuts.OverlapZone
) -> PlacedPatch:
    """Of the first `tries` places the one whose seam is cheapest."""
    found = (_place_patch(sketch, shown, place, size, zone) for place in order[: sketch.tries])
    return min(found, key=lambda laid: laid.seam.energy)


def _place_patch(
    sketch: SearchProblem, shown: tuple, place: Int[Array, "2"], size: tuple[int, int], zone: cuts.OverlapZone
) -> PlacedPatch:
    """A patch in its place, cut against what is shown."""
    y, x = np.mgrid[: size[1], : size[0]]
    gamma = sketch.gamma(place, size)
    return PlacedPatch(place, sketch.cut(shown, (y + place[1], x + place[0]), gamma, zone), gamma)
