"""Alpha-expansion over all patches of a tile at once, as the paper has it: an alternative to exact binary cuts.

A move lets every cell keep its patch or take one patch, alpha, at the least cost, found as a cut. W is no metric: a
seam between two patches can cost more than two seams across a third. Where it breaks the triangle inequality no cut
can represent a move's true cost, so the two seams are priced as high as the one; such edges are counted. A move then
costs at least what it truly does, and keeping all costs exactly that: the energy never rises.
"""

from dataclasses import dataclass, replace
from typing import Any

import maxflow
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.lod.store import Levels
from dav_gswt.tiles.build import TileSet, TilingOptions, cut_levels
from dav_gswt.tiles.energy import Cells, CostLayer, divide_terms
from dav_gswt.tiles.layout import CENTRE, LABELS, NE, NW, SE, SW, E, Layout, N, S, W
from dav_gswt.tiles.search import PlacedPatch, Relabel, SearchProblem

QUANTA = 2.0**26  # of a seam between random places on flat ground: costs are whole numbers, as those of cuts
CYCLES = 8  # over all patches, at most


def cut_by_expansion(levels: Levels, options: TilingOptions, rng: np.random.Generator) -> TileSet:
    """`tiles.build.cut_levels` with semantic cuts, after which all patches of every tile are expanded."""
    records: list[dict[str, Any]] = []
    options = replace(options, kind="semantic", relabel=make_relabel(records))
    return add_records(cut_levels(levels, options, rng), records)


def make_relabel(records: list[dict[str, Any]]) -> Relabel:
    """The relabelling of `TilingOptions` that expands all patches of a tile; what it did is appended to `records`."""

    def relabel(
        problem: SearchProblem, centre: PlacedPatch, labels: UInt8[Array, "n n"], shift: Int[Array, "9 2"]
    ) -> UInt8[Array, "n n"]:
        # where a patch may not lie, any cell will do
        shown = [problem.source_cells(np.full(labels.shape, label), shift) for label in range(len(LABELS))]
        rows, columns = (np.stack([cells[axis] for cells in shown]) for axis in (0, 1))
        patches = Patches(rows, columns, allowed_cells(problem.plan))
        found = expand_labels(labels, patches, problem.energy.terms(centre.gamma))
        records.append(found.describe())
        return found.labels

    return relabel


def add_records(tiles: TileSet, records: list[dict[str, Any]]) -> TileSet:
    """The tile set with the records under `expansion` in its report."""
    return replace(tiles, report=tiles.report | {"energy": "expansion", "expansion": records})


@dataclass(frozen=True)
class Patches:
    """Patches over one grid. shown: rows and columns of the exemplar's cells that each shows in each cell of the grid;
    allowed: the cells where it may come to lie.
    """

    rows: Int[Array, "labels h w"]
    columns: Int[Array, "labels h w"]
    allowed: Bool[Array, "labels h w"]


@dataclass(frozen=True)
class ExpansionResult:
    """labels: of the last move. energies: of all seams, before the first move and after each that was made. broken:
    edges of all moves tried where the triangle did not hold, of `tested`.
    """

    labels: UInt8[Array, "h w"]
    energies: list[float]
    broken: int
    tested: int

    def describe(self) -> dict:
        return {"before": self.energies[0], "after": self.energies[-1], "moves": len(self.energies) - 1} | {
            "triangles_broken": self.broken,
            "triangles_tested": self.tested,
        }


@dataclass(frozen=True)
class _Edges:
    """Neighbouring cells, by their place in the flattened grid; axis 0 is along x."""

    tails: Int[Array, "e"]
    heads: Int[Array, "e"]
    axis: Int[Array, "e"]

    def touching(self, cells: Bool[Array, "n"]) -> "_Edges":
        """Those with a cell at either end."""
        pick = cells[self.tails] | cells[self.heads]
        return _Edges(self.tails[pick], self.heads[pick], self.axis[pick])


def expand_labels(
    labels: UInt8[Array, "h w"], patches: Patches, terms: list[tuple[float, CostLayer]]
) -> ExpansionResult:
    """Expand every patch in turn until none lowers the energy; of one patch alone nothing changes.

    terms: see `SeamEnergy.terms`. Cells where no other patch is allowed keep theirs.
    """
    n, edges, found = len(patches.rows), _edges(labels.shape), labels.ravel().astype(np.int64)
    price = _Price(terms, patches.rows.reshape(n, -1), patches.columns.reshape(n, -1))
    energies = [int(price.of(edges, found[edges.tails], found[edges.heads]).sum())]
    broken = tested = idle = 0
    for step in range(CYCLES * n):
        alpha = step % n
        free = patches.allowed[alpha].ravel() & (found != alpha)
        move = _best_move(found, free, alpha, edges.touching(free), price)
        broken, tested, idle = broken + move.broken, tested + move.tested, idle + 1
        if move.change < 0:
            found, idle = np.where(move.taken, alpha, found), 0
            energies.append(energies[-1] + move.change)
        if idle == n:
            break
    return ExpansionResult(found.reshape(labels.shape).astype(np.uint8), [e / QUANTA for e in energies], broken, tested)


@dataclass(frozen=True)
class _Price:
    """W in whole quanta. rows, columns: see Patches, flattened."""

    terms: list[tuple[float, CostLayer]]
    rows: Int[Array, "labels n"]
    columns: Int[Array, "labels n"]

    def of(self, edges: _Edges, at_tail: Int[Array, "e"], at_head: Int[Array, "e"]) -> Int[Array, "e"]:
        """Cost of edges with one patch at the tail and another at the head; 0 where it is the same one."""
        out = np.zeros(len(at_tail), np.int64)
        seams = np.flatnonzero(at_tail != at_head)
        first, second = at_tail[seams], at_head[seams]
        ends = edges.tails[seams], edges.heads[seams]
        tails, heads = ((self._source_cells(first, end), self._source_cells(second, end)) for end in ends)
        out[seams] = np.rint(compute_costs_along(self.terms, tails, heads, edges.axis[seams]) * QUANTA)
        return out

    def _source_cells(self, label: Int[Array, "s"], cell: Int[Array, "s"]) -> Cells:
        """The exemplar's cells that patches show in cells of the tile."""
        return self.rows[label, cell], self.columns[label, cell]


@dataclass(frozen=True)
class _Move:
    """taken: which cells take alpha. change: of the true energy."""

    taken: Bool[Array, "n"]
    change: int
    broken: int
    tested: int


def _best_move(found: Int[Array, "n"], free: Bool[Array, "n"], alpha: int, edges: _Edges, price: _Price) -> _Move:
    """The cheapest way for free cells to keep their patch or take alpha.

    With x = 1 where alpha is taken, an edge costs keep at (0, 0), enter at (0, 1), leave at (1, 0), nothing at (1, 1):
    keep + (leave - keep) x_s - leave x_t + (enter + leave - keep) (1 - x_s) x_t; a cell that is not free has x = 0.
    """
    if not free.any():
        return _Move(free, 0, 0, 0)
    s, t = edges.tails, edges.heads
    other = np.full(len(s), alpha)
    keep, enter, leave = (price.of(edges, *at) for at in ((found[s], found[t]), (found[s], other), (other, found[t])))
    both = free[s] & free[t]
    lack = np.where(both, np.maximum(keep - enter - leave, 0), 0)
    into, out = enter + lack // 2, leave + lack - lack // 2
    cost = np.zeros(len(found), np.int64)  # of taking alpha, by itself
    np.add.at(cost, s[free[s]], (out - keep)[free[s]])
    np.add.at(cost, t[both], -out[both])
    np.add.at(cost, t[free[t] & ~both], (into - keep)[free[t] & ~both])
    node = np.cumsum(free) - 1
    graph = maxflow.GraphInt()
    nodes = graph.add_nodes(int(free.sum()))
    graph.add_edges(node[s[both]], node[t[both]], (into + out - keep)[both], np.zeros(both.sum(), np.int64))
    graph.add_grid_tedges(nodes, np.maximum(cost[free], 0), np.maximum(-cost[free], 0))
    graph.maxflow()
    taken = free.copy()
    taken[free] = graph.get_grid_segments(nodes)
    now = np.select([taken[s] & taken[t], taken[t], taken[s]], [np.zeros_like(keep), enter, leave], keep)
    tested = both & (found[s] != found[t])
    return _Move(taken, int((now - keep).sum()), int((lack > 0).sum()), int(tested.sum()))


def _edges(shape: tuple[int, int]) -> _Edges:
    cell = np.arange(shape[0] * shape[1]).reshape(shape)
    right, upper = (cell[:, :-1], cell[:, 1:]), (cell[:-1], cell[1:])
    tails, heads = (np.concatenate([right[i].ravel(), upper[i].ravel()]) for i in (0, 1))
    return _Edges(tails, heads, np.repeat([0, 1], [right[0].size, upper[0].size]))


def allowed_cells(layout: Layout) -> Bool[Array, "9 n n"]:
    """Where each label's patch may come to lie in a tile: the centre anywhere, a strip along its side but for the
    corners, a corner patch in its corner. The outermost `block` cells are the frame's: their neighbours are in other
    tiles.
    """
    n, b, a = layout.side, layout.strip, layout.corner
    low, high = np.arange(n) < a, np.arange(n) >= n - a
    side = (np.arange(n) >= b) & (np.arange(n) < n - b)
    inner = (np.arange(n) >= layout.block) & (np.arange(n) < n - layout.block)
    out = np.zeros((len(LABELS), n, n), bool)
    out[CENTRE] = True
    for label, ys, xs in ((W, side, slice(b)), (E, side, slice(n - b, n))):
        out[label, ys, xs] = True
        out[(S, N)[label - W]] = out[label].T
    for label, ys, xs in ((SW, low, low), (SE, low, high), (NW, high, low), (NE, high, high)):
        out[label] = ys[:, None] & xs
    return out & inner[:, None] & inner


def compute_costs_along(
    terms: list[tuple[float, CostLayer]],
    tails: tuple[Cells, Cells],
    heads: tuple[Cells, Cells],
    axis: Int[Array, "edges"],
) -> Float[Array, "edges"]:
    """W of single edges: what the first and the second patch show at each one's tail and head; axis 0 is along x."""
    parts = []
    for share, layer in terms:
        d = (layer.distances(*tails) + layer.distances(*heads)) * share
        (a, b), (e, f) = ([layer.slope[(*cells, axis)] for cells in end] for end in (tails, heads))
        parts.append((d, ((a + b) + (e + f)) * share, layer.unit))
    return divide_terms(parts)
