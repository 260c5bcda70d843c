"""The search for patches: a corner, strips cut against it, then every tile's centre cut against its frame."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array
from scipy.ndimage import distance_transform_edt

from dav_gswt.logs import progress
from dav_gswt.tiles import layout, patches
from dav_gswt.tiles.energy import Cells, Cut, OverlapZone, SeamEnergy, compute_edge_costs, find_cut
from dav_gswt.tiles.layout import CENTRE, EDGES, Layout, PatchPlaces
from dav_gswt.tiles.periods import Pattern

MIN_FITTING = 4  # times the number of tries: least number of fitting places
MAX_PAIRED = 200  # strips that are compared pairwise
REPETITION_COST = 2.0  # of `patches.OverlaidPatches`, where a median seam costs 1

Relabel = Callable[..., UInt8[Array, "n n"]]  # (problem, centre, labels, shift) -> labels


@dataclass(frozen=True)
class PlacedPatch:
    """A patch in its place: where in the exemplar it comes from, its cut, and the weight that colour had in it."""

    place: Int[Array, "2"]
    seam: Cut
    gamma: float


@dataclass(frozen=True)
class SearchProblem:
    """Input of the search.

    Attributes:
        plan: sizes of tiles and patches.
        guide: maps that candidate places are ranked by.
        energy: what seams cost.
        candidates: places that are compared; tries: the best of them that are cut before one is taken.
        relabel: replaces a tile's labels, given its centre, labels and shifts, after the exact cut;
            None: labels stay.
        pattern: that patches continue; None: the ground has none.
    """

    plan: Layout
    guide: patches.GuidanceMaps
    energy: SeamEnergy
    candidates: int
    tries: int
    relabel: Relabel | None = None
    pattern: Pattern | None = None

    def draw(self, size: tuple[int, int], move: Int[Array, "2"], rng: np.random.Generator) -> Int[Array, "n 2"]:
        """Candidate places of a patch over ground that is known, in phase with the corner patch.

        move: of a tile's cells under the patch, less that of the cells under the corner (`layout.label_shifts`).
        """
        places = patches.list_places(self.plan, size)
        if self.pattern is not None:
            places = self.pattern.admit(places, move)
        drawn = patches.draw_places(places, self.candidates, rng)
        return patches.keep_certain(self.guide, drawn, size)

    def place(self, shown: Cells, place: Int[Array, "2"], size: tuple[int, int], zone: OverlapZone) -> PlacedPatch:
        """Cut a patch from a place against the exemplar's cells (rows, columns) that are visible before the cut."""
        y, x = np.mgrid[: size[1], : size[0]]
        uncertainty = float(patches.patch_means(self.guide.uncertainty, place[None], size)[0])
        gamma = self.energy.gamma(uncertainty)
        costs = compute_edge_costs(self.energy.terms(gamma), shown, (y + place[1], x + place[0]))
        forced = (~zone.straight, zone.straight) if self.energy.kind == "none" else (zone.keep, zone.take)
        return PlacedPatch(place, find_cut(*costs, *forced), gamma)

    def source_cells(self, labels: Array, shift: Int[Array, "k 2"]) -> Cells:
        """Rows and columns of the exemplar that a label map shows, clipped to the exemplar."""
        rows, columns = layout.source_cells(labels, shift)
        last = self.plan.exemplar - 1
        return np.clip(rows, 0, last), np.clip(columns, 0, last)


@dataclass(frozen=True)
class SearchResult:
    """Places and cuts.

    Attributes:
        places: of all patches.
        vertical, horizontal: by edge colour, the cells of a strip that show the corner patch.
        strips: vertical 0, 1, then horizontal 0, 1.
        centres: of the tiles.
        labels: of the tiles.
    """

    places: PatchPlaces
    vertical: Bool[Array, "2 n w"]
    horizontal: Bool[Array, "2 w n"]
    strips: list[PlacedPatch]
    centres: list[PlacedPatch]
    labels: UInt8[Array, "tiles n n"]


def search_patches(problem: SearchProblem, variants: int, rng: np.random.Generator) -> SearchResult:
    """Find all places and cuts of 16 x `variants` tiles."""
    corner = patches.find_least_salient(problem.guide, problem.plan)
    used = [(corner, (2 * problem.plan.corner, 2 * problem.plan.corner))]
    upright, flat = (_search_strips(problem, corner, way, used, rng) for way in (True, False))
    sides = [np.stack([strip.place for strip in pair]) for pair in (upright, flat)]
    masks = [np.stack([~strip.seam.labels for strip in pair]) for pair in (upright, flat)]
    places = PatchPlaces(corner, sides[0], sides[1], np.zeros((EDGES * variants, 2), int))
    centres, labels = _search_centres(problem, places, masks, rng)
    places = PatchPlaces(corner, sides[0], sides[1], np.stack([centre.place for centre in centres]))
    return SearchResult(places, masks[0], masks[1], upright + flat, centres, labels)


def _search_strips(
    problem: SearchProblem,
    corner: Array,
    upright: bool,
    used: list[patches.UsedPatch],
    rng: np.random.Generator,
) -> list[PlacedPatch]:
    """Find the two strips of one direction and cut each against the corner patch; they are appended to `used`."""
    plan = problem.plan
    n, b, a = plan.side, plan.strip, plan.corner
    size = (2 * b, n) if upright else (n, 2 * b)
    y, x = np.mgrid[: size[1], : size[0]]
    along = y if upright else x
    depth = np.minimum(along, n - 1 - along)
    straight = depth >= (a + b) // 2  # the strip where it is not cut
    overlap = OverlapZone(depth < b, depth >= a, straight)
    ends = np.where(along < n // 2, 1, 2)
    shown = problem.source_cells(ends, layout.strip_shifts(plan, np.zeros(2, int), corner, upright))
    drawn = problem.draw(size, np.array([b, 0] if upright else [0, b]) - corner - a, rng)
    margin = np.array([b - (plan.block + b) // 2, (a + b) // 2])[:: 1 if upright else -1]
    inner = (size[0] - 2 * int(margin[0]), size[1] - 2 * int(margin[1]))  # about what centres and the corner leave
    landmarks = patches.patch_means(problem.guide.landmarks, drawn + margin, inner)
    places, cost = _choose_strip_candidates(problem, shown, _end_lines(plan, upright), drawn, size, landmarks)
    overlay = patches.start_overlay(problem.guide.features[..., :3], n, size, cover=(~straight, shown))
    pair_cost = REPETITION_COST * overlay.compute_pair_costs(places)
    pairs = patches.rank_pairs(places, cost, pair_cost, size, used)[: problem.tries]
    placed = [[problem.place(shown, place, size, overlap) for place in pair] for pair in pairs]
    best = min(placed, key=lambda strips: sum(strip.seam.energy for strip in strips))
    used += [(strip.place, size) for strip in best]
    return best


def _choose_strip_candidates(
    problem: SearchProblem,
    shown: Cells,
    lines: Cells,
    places: Int[Array, "n 2"],
    size: tuple[int, int],
    landmarks: Float[Array, "n"],
) -> tuple[Int[Array, "k 2"], Float[Array, "k"]]:
    """At most MAX_PAIRED places that fit the corner patch and are inconspicuous, with their relative costs.

    shown: the exemplar's cells that the corner patch shows in the strip. lines: see `patches.compute_mismatch`.
    landmarks: share of them in each place, over the exemplar's.
    """
    mismatch = patches.compute_mismatch(problem.guide, lines, (shown[0][lines], shown[1][lines]), places)
    saliency = patches.patch_saliency(problem.guide, places, size)
    fits = np.intersect1d(patches.find_fitting(mismatch), patches.find_fitting(saliency))
    cost = patches.divide_by_median(mismatch) + patches.divide_by_median(saliency)
    cost = cost + patches.LANDMARK_COST * landmarks
    if len(fits) < MIN_FITTING * problem.tries:  # too few fit both ways: take the best of the sum
        fits = np.argsort(cost, kind="stable")[: MIN_FITTING * problem.tries]
    fits = fits[np.argsort(cost[fits], kind="stable")[:MAX_PAIRED]]
    return places[fits], cost[fits]


def _search_centres(
    problem: SearchProblem, places: PatchPlaces, masks: list, rng: np.random.Generator
) -> tuple[list[PlacedPatch], UInt8[Array, "tiles n n"]]:
    """Find every tile's centre, no two of them the same, and cut it against the tile's frame."""
    plan = problem.plan
    n, b = plan.side, plan.strip
    y, x = np.mgrid[:n, :n]
    depth = np.minimum(np.minimum(x, n - 1 - x), np.minimum(y, n - 1 - y))
    frame = (plan.block + b) // 2  # its width where the cut is straight
    overlap = OverlapZone(depth < plan.block, depth >= b, depth >= frame)
    size = (n, n)
    drawn = problem.draw(size, -places.corner - plan.corner, rng)
    overlay = patches.start_overlay(problem.guide.features[..., :3], n, size, (frame, frame))
    crops, mismatch = overlay.crop_all(drawn), _compare_sides(problem, places, masks, drawn)
    centres: list[PlacedPatch] = []
    found = []
    for tile in progress(range(len(places.centres)), "cut tiles"):
        frame_labels, shift, shown = _show_frame(problem, places, masks, tile)
        cost = mismatch[layout.edge_colours(tile), range(4)].mean(0)
        order = _rank_centres(problem, places, drawn, cost, overlay.compute_costs(crops), centres)
        placed = (problem.place(shown, place, size, overlap) for place in order[: problem.tries])
        centre = min(placed, key=lambda patch: patch.seam.energy)
        labels = np.where(centre.seam.labels, CENTRE, frame_labels).astype(np.uint8)
        shift[CENTRE] = centre.place
        if problem.relabel is not None:
            labels = problem.relabel(problem, centre, labels, shift)
        centres.append(centre)
        found.append(labels)
        overlay = overlay.with_patch(centre.place)
    return centres, np.stack(found)


def _show_frame(
    problem: SearchProblem, places: PatchPlaces, masks: list, tile: int
) -> tuple[UInt8[Array, "n n"], Int[Array, "9 2"], Cells]:
    """Labels of a tile's frame, shifts, and the exemplar's cells that it shows.

    A seam along the frame's inner rim is priced by what the strips would show beyond it.
    """
    labels = layout.frame_labels(problem.plan, masks[0], masks[1], tile)
    shift = layout.label_shifts(problem.plan, places, tile)
    nearest = distance_transform_edt(labels == CENTRE, return_distances=False, return_indices=True)
    return labels, shift, problem.source_cells(labels[tuple(nearest)], shift)


def _compare_sides(
    problem: SearchProblem, places: PatchPlaces, masks: list, drawn: Int[Array, "n 2"]
) -> Float[Array, "2 4 n"]:
    """What each place's centre would cost along the sides W, N, E and S of a frame, by the edge's colour."""
    found = []
    for tile in (0, EDGES - 1):  # all sides of colour 0, of colour 1
        _, _, shown = _show_frame(problem, places, masks, tile)
        sides = [(lines, (shown[0][lines], shown[1][lines])) for lines in _side_lines(problem.plan)]
        found.append([patches.compute_mismatch(problem.guide, *side, drawn) for side in sides])
    return np.array(found)


def _rank_centres(
    problem: SearchProblem,
    places: PatchPlaces,
    drawn: Int[Array, "n 2"],
    mismatch: Float[Array, "n"],
    repetition: Float[Array, "n"],
    centres: list[PlacedPatch],
) -> Int[Array, "k 2"]:
    """Candidate places of the next tile's centre from best to worst, without those of its other variants.

    mismatch: along the tile's frame. repetition: see `OverlaidPatches`. centres: of the tiles that are cut already.
    """
    plan, tile = problem.plan, len(centres)
    n, b = plan.side, plan.strip
    fits = patches.find_fitting(mismatch)
    cost = patches.divide_by_median(mismatch[fits]) + REPETITION_COST * repetition[fits]
    west, north, east, south = layout.edge_colours(tile)
    adjacent = [(places.vertical[c], (2 * b, n)) for c in sorted({west, east})]
    adjacent += [(places.horizontal[c], (n, 2 * b)) for c in sorted({south, north})]
    taken = np.array([other.place for other in centres], int).reshape(-1, 2)
    order = patches.rank_places(drawn[fits], cost, (n, n), adjacent, taken)
    variants = {tuple(other.place) for other in centres[tile % EDGES :: EDGES]}
    return np.array([place for place in order if tuple(place) not in variants] or order)


def _end_lines(plan: Layout, upright: bool) -> tuple[Array, Array]:
    """Cells [line, cell] where a strip may be cut against the corner patch: lines along the strip, one for each cell of
    its width, at both ends.
    """
    across = np.tile(np.arange(2 * plan.strip), 2)[:, None]
    depth = np.arange(plan.strip, plan.corner)
    along = np.concatenate([np.tile(depth, (2 * plan.strip, 1)), np.tile(plan.side - 1 - depth, (2 * plan.strip, 1))])
    across = np.broadcast_to(across, along.shape)
    return (along, across) if upright else (across, along)


def _side_lines(plan: Layout) -> list[tuple[Array, Array]]:
    """Cells [line, cell] where a centre may be cut, for W, N, E and S: lines from the border inwards, one for each cell
    of a side.
    """
    n = plan.side
    depth = np.tile(np.arange(plan.block, plan.strip), (n, 1))
    along = np.broadcast_to(np.arange(n)[:, None], depth.shape)
    return [(along, depth), (n - 1 - depth, along), (along, n - 1 - depth), (depth, along)]
