"""Exact binary cuts between two patches: where the eye is least likely to find the seam.

The cost of a seam between neighbouring cells s and t is Eq. (graphcut_main) of the paper for colour alone (gamma =
1), in the main text's form D/G: a difference is cheap where both patches have a strong gradient anyway. D(s, t) =
d(s) + d(t) with d = |A - B|, G(s, t) = the four gradients along the edge; both over scales frozen for the exemplar.
"""

from dataclasses import dataclass

import maxflow
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

EPS = 1.0  # of the mean gradient: with less, a cut through a bush (steep everywhere) is as cheap as one through sand
QUANTA = 2.0**32  # capacities are whole numbers, the largest this big: the flow is exact and order-independent


@dataclass(frozen=True)
class Scales:
    """Units of difference and gradient, frozen once for an exemplar."""

    difference: float
    gradient: float


@dataclass(frozen=True)
class Cut:
    """labels: which cells show the second patch. energy: the seam's cost. flow, cost: the same in whole quanta, both
    ways.
    """

    labels: Bool[Array, "h w"]
    energy: float
    flow: int
    cost: int


def gradients(colour: Float[Array, "h w c"]) -> Float[Array, "h w 2"]:
    """Colour change per cell along x and along y (central differences, 2-norm over channels)."""
    return np.stack([np.linalg.norm(np.gradient(colour, axis=axis), axis=-1) for axis in (1, 0)], -1)


def scales(colour: Float[Array, "h w c"]) -> Scales:
    """Scales of an exemplar: the root mean square of D between two places drawn at random, and the mean of G."""
    spread = float(np.sqrt(2 * colour.reshape(-1, colour.shape[-1]).var(0).sum()))
    slope = float(gradients(colour).mean())
    return Scales(2 * spread or 1.0, 4 * slope or 1.0)


def weights(
    a: Float[Array, "h w c"],
    b: Float[Array, "h w c"],
    gradients_a: Float[Array, "h w 2"],
    gradients_b: Float[Array, "h w 2"],
    unit: Scales,
) -> tuple[Float[Array, "h w1"], Float[Array, "h1 w"]]:
    """Cost of a seam between every cell and its right neighbour, and between every cell and its upper one.

    W = (D / unit.difference) / (G / unit.gradient + EPS): symmetric in the patches, finite, and 0 where they are equal.
    """
    d = np.linalg.norm(a - b, axis=-1)
    g = gradients_a + gradients_b
    right = (d[:, :-1] + d[:, 1:]) / unit.difference / ((g[:, :-1, 0] + g[:, 1:, 0]) / unit.gradient + EPS)
    upper = (d[:-1] + d[1:]) / unit.difference / ((g[:-1, :, 1] + g[1:, :, 1]) / unit.gradient + EPS)
    return right, upper


def cut(
    right: Float[Array, "h w1"], upper: Float[Array, "h1 w"], first: Bool[Array, "h w"], second: Bool[Array, "h w"]
) -> Cut:
    """The cheapest partition of a grid into two patches, exactly (max-flow).

    right, upper: costs of parting a cell from its right and its upper neighbour. first, second: cells that must show
    the first and the second patch; the others are free. Only free cells become nodes, so a wide forced region costs
    nothing.
    Raises: ValueError: a cell is forced both ways, or a cost is negative or not finite.
    """
    if (first & second).any():
        raise ValueError("a cell is forced to both patches")
    largest = max(right.max(initial=0), upper.max(initial=0))
    if not (np.isfinite(largest) and min(right.min(initial=0), upper.min(initial=0)) >= 0):
        raise ValueError("seam costs must be finite and not negative")
    unit = QUANTA / largest if largest > 0 else 1.0
    right, upper = (np.rint(w * unit).astype(np.int64) for w in (right, upper))
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
        graph.add_grid_tedges(nodes, _to(-1, tails, heads, costs, free), _to(-2, tails, heads, costs, free))
        flow += graph.maxflow()
        labels[node >= 0] = graph.get_grid_segments(nodes)
    cost = int(right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum())
    return Cut(labels, float(cost / unit), int(flow), cost)


def _to(terminal: int, tails: Array, heads: Array, costs: Array, free: int) -> Array:
    """Capacity from each free node to a terminal: the sum over its neighbours that are forced to it.

    Summed in whole numbers: bincount's weights are floating.
    """
    out = np.zeros(free, np.int64)
    for here, there in ((tails, heads), (heads, tails)):
        pick = (here >= 0) & (there == terminal)
        np.add.at(out, here[pick], costs[pick])
    return out
