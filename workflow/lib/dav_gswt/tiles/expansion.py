"""Alpha-expansion over all the patches of a tile at once, as the paper has it: an alternative to exact binary cuts.

A move lets every cell either keep its patch or take one patch, alpha, at the least cost, found as a cut. W is no metric
(a seam from one patch to another can cost more than two seams over a third), and where it breaks the triangle no cut
can tell a move's true cost: the two seams are taken for dearer, as dear as the one together. Such edges are counted. A
move then costs at least what it truly does, and to keep all as it is costs exactly that: the energy never rises.
"""

from dataclasses import dataclass

import maxflow
import numpy as np
from jaxtyping import Bool, Int, UInt8
from numpy import ndarray as Array

from dav_gswt.tiles import energy

QUANTA = 2.0**26  # of a seam between places at random on flat ground: costs are whole numbers, as those of cuts
CYCLES = 8  # over all patches, at most


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


def expand_labels(labels: UInt8[Array, "h w"], patches: Patches, terms: list) -> ExpansionResult:
    """Expand every patch in turn until none lowers the energy; of one patch alone nothing changes.

    terms: see energy.Energy.terms. Cells where no other patch is allowed keep theirs.
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

    terms: list
    rows: Int[Array, "labels n"]
    columns: Int[Array, "labels n"]

    def of(self, edges: _Edges, at_tail: Int[Array, "e"], at_head: Int[Array, "e"]) -> Int[Array, "e"]:
        """Cost of edges with one patch at the tail and another at the head; 0 where it is the same one."""
        out = np.zeros(len(at_tail), np.int64)
        seams = np.flatnonzero(at_tail != at_head)
        pair = at_tail[seams], at_head[seams]
        ends = (edges.tails[seams], edges.heads[seams])
        shown = [tuple((self.rows[label, end], self.columns[label, end]) for label in pair) for end in ends]
        out[seams] = np.rint(energy.compute_costs_along(self.terms, *shown, edges.axis[seams]) * QUANTA)
        return out


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
