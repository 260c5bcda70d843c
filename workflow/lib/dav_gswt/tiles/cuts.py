"""Exact binary cuts between two patches (max-flow): the seam of the least cost, by the costs of `energy`."""

from dataclasses import dataclass

import maxflow
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

QUANTA = 2.0**32  # capacities are whole numbers, the largest this big: the flow is exact and order-independent


@dataclass(frozen=True)
class OverlapZone:
    """Where two patches lie over one another. keep, take: cells that must show the first and the second patch; a seam
    runs through the others. straight: what shows the second patch where none is cut, to the middle of the overlap.
    """

    keep: Bool[Array, "h w"]
    take: Bool[Array, "h w"]
    straight: Bool[Array, "h w"]


@dataclass(frozen=True)
class Cut:
    """labels: which cells show the second patch. energy: the seam's cost. flow, cost: the same in whole quanta, both
    ways; equal where the seam is the cheapest one.
    """

    labels: Bool[Array, "h w"]
    energy: float
    flow: int
    cost: int


def find_cut(
    right: Float[Array, "h w1"], upper: Float[Array, "h1 w"], first: Bool[Array, "h w"], second: Bool[Array, "h w"]
) -> Cut:
    """The cheapest partition of a grid into two patches, exactly (max-flow). All of it may be one patch.

    right, upper: costs of parting a cell from its right and its upper neighbour. first, second: cells that must show
    the first and the second patch; the others are free. Only free cells become nodes, so a wide forced region costs
    nothing.
    Raises: ValueError: a cell is forced both ways, or a cost is negative or not finite.
    """
    if (first & second).any():
        raise ValueError("a cell is forced to both patches")
    right, upper, unit = _quantize(right, upper)
    node = np.cumsum(~(first | second)).reshape(first.shape) - 1
    free = int(node[-1, -1]) + 1
    node[first], node[second] = -1, -2
    tails = np.concatenate([node[:, :-1].ravel(), node[:-1].ravel()])
    heads = np.concatenate([node[:, 1:].ravel(), node[1:].ravel()])
    costs = np.concatenate([right.ravel(), upper.ravel()])
    base = int(costs[np.minimum(tails, heads) + np.maximum(tails, heads) == -3].sum())  # forced cells side by side
    labels, flow = second.copy(), base
    if free:
        graph = maxflow.GraphInt()
        nodes = graph.add_nodes(free)
        inner = (tails >= 0) & (heads >= 0) & (costs > 0)
        graph.add_edges(tails[inner], heads[inner], costs[inner], costs[inner])
        graph.add_grid_tedges(
            nodes,
            _terminal_capacities(-1, tails, heads, costs, free),
            _terminal_capacities(-2, tails, heads, costs, free),
        )
        flow += graph.maxflow()
        labels[node >= 0] = graph.get_grid_segments(nodes)
    cost = _sum_costs(labels, right, upper)
    return Cut(labels, float(cost / unit), int(flow), cost)


def price_cut(right: Float[Array, "h w1"], upper: Float[Array, "h1 w"], labels: Bool[Array, "h w"]) -> Cut:
    """The cost of a given seam. Raises: ValueError: a cost is negative or not finite."""
    right, upper, unit = _quantize(right, upper)
    cost = _sum_costs(labels, right, upper)
    return Cut(labels, float(cost / unit), cost, cost)


def _quantize(right: Array, upper: Array) -> tuple[Array, Array, float]:
    """Costs in whole quanta, and how many of them one is."""
    largest = max(right.max(initial=0), upper.max(initial=0))
    if not (np.isfinite(largest) and min(right.min(initial=0), upper.min(initial=0)) >= 0):
        raise ValueError("seam costs must be finite and not negative")
    unit = QUANTA / largest if largest > 0 else 1.0
    return np.rint(right * unit).astype(np.int64), np.rint(upper * unit).astype(np.int64), unit


def _sum_costs(labels: Array, right: Array, upper: Array) -> int:
    return int(right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum())


def _terminal_capacities(terminal: int, tails: Array, heads: Array, costs: Array, free: int) -> Array:
    """Capacity from each free node to a terminal: the sum over its neighbours that are forced to it.

    Summed in whole numbers: bincount's weights are floating.
    """
    out = np.zeros(free, np.int64)
    for here, there in ((tails, heads), (heads, tails)):
        pick = (here >= 0) & (there == terminal)
        np.add.at(out, here[pick], costs[pick])
    return out
