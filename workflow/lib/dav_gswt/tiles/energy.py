"""What a seam costs, and the cheapest seam: Eq. (graphcut_main) of the paper, in a form that is safe in floating point.

The cost of a seam between neighbouring cells s and t is

    W(s, t) = (gamma D_I + (1 - gamma) D_S) / (gamma G_I + (1 - gamma) G_S + EPS):

a difference is cheap where both patches have a strong gradient anyway. I is colour, S the semantic layer (`semantics`).
D(s, t) = d(s) + d(t), d the distance between what the two patches show in a cell; G(s, t) = the four gradients along
the edge, two of each patch; every D and G is divided by its scale, frozen for the exemplar. gamma is high where the
ground is certain. Cells hidden by occluders (`make_occluder_layer`) have a D of their own and no G: otherwise a cut
through a shrub would be cheap. W is symmetric in the patches, finite, not negative, and 0 where they are equal.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import maxflow
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from dav_gswt.views.uncertainty import gamma

OCCLUDER_WEIGHT = 2.0  # D of a hidden cell beside bare ground, in units of two random colours
EPS = 1.0  # of the mean gradient: with less, a cut through a bush (steep everywhere) is as cheap as one through sand
ROUNDING = 1e-9  # of colours, which are about 1
QUANTA = 2.0**32  # capacities are whole numbers, the largest this big: the flow is exact and order-independent

Cells = tuple[Array, Array]  # rows and columns of the exemplar's cells, of any one shape


@dataclass(frozen=True)
class LayerScales:
    """Units of difference and gradient, frozen once for an exemplar."""

    difference: float
    gradient: float


@dataclass(frozen=True)
class CostLayer(ABC):
    """A description of an exemplar: distances between cells, the gradient along x and y in each, and their scales."""

    slope: Float[Array, "h w 2"]
    unit: LayerScales

    @abstractmethod
    def distances(self, first: Cells, second: Cells) -> Float[Array, "..."]: ...


@dataclass(frozen=True)
class ColourLayer(CostLayer):
    """Colours of the exemplar's cells; cells are as far apart as their colours (2-norm)."""

    values: Float[Array, "h w c"]

    def distances(self, first: Cells, second: Cells) -> Float[Array, "..."]:
        return np.linalg.norm(self.values[first] - self.values[second], axis=-1)


def make_colour_layer(values: Float[Array, "h w c"]) -> ColourLayer:
    """The layer of colours. Their scale of difference is the root mean square of D between two random places."""
    slope = compute_gradients(values)
    spread = float(np.sqrt(2 * values.reshape(-1, values.shape[-1]).var(0).sum()))
    return ColourLayer(slope, make_scales(spread, slope), values)


def make_occluder_layer(cover: Float[Array, "h w"]) -> ColourLayer | None:
    """Share of each cell that occluders hide, in [0, 1], as a layer without gradient; None where nothing is hidden."""
    if not cover.any():
        return None
    return ColourLayer(np.zeros((*cover.shape, 2)), LayerScales(1.0, 1.0), cover[..., None])


def compute_gradients(values: Float[Array, "h w c"]) -> Float[Array, "h w 2"]:
    """Change per cell along x and along y (central differences, 2-norm over channels)."""
    return np.stack([np.linalg.norm(np.gradient(values, axis=axis), axis=-1) for axis in (1, 0)], -1)


def make_scales(spread: float, slope: Float[Array, "h w 2"]) -> LayerScales:
    """spread: root mean square distance of two cells."""
    return LayerScales(safe_unit(2 * spread), safe_unit(4 * float(slope.mean())))


def safe_unit(value: float) -> float:
    """A unit to divide by; 1 for a value that is 0 but for rounding."""
    return value if value > ROUNDING else 1.0


@dataclass(frozen=True)
class SeamEnergy:
    """How seams are cut and priced.

    Attributes:
        kind: `none` (straight), `colour`, `semantic` or `semantic-nogamma`.
        slope: of gamma as a function of uncertainty; the paper's is 2.
        colours, semantics: layers; semantics are None for colour alone.
        occluders: share of each cell that is hidden; None for nothing.
    """

    kind: str
    slope: float
    colours: CostLayer
    semantics: CostLayer | None
    occluders: CostLayer | None = None

    def gamma(self, uncertainty: float) -> float:
        """Weight of colour in the seams of a patch of this mean uncertainty in [0, 1].

        Without semantics 1, `semantic-nogamma` 1/2. Raises: ValueError: uncertainty is NaN.
        """
        if self.semantics is None:
            return 1.0
        weight = float(gamma(np.array([uncertainty], float), self.slope)[0])
        return 0.5 if self.kind == "semantic-nogamma" else weight

    def terms(self, share: float) -> list[tuple[float, CostLayer]]:
        """The layers with their weights, at a weight of colour of `share`; one that weighs nothing is left out.

        Occluders weigh the same whatever the uncertainty.
        """
        layers = (share, self.colours), (1 - share, self.semantics), (OCCLUDER_WEIGHT, self.occluders)
        return [(weight, layer) for weight, layer in layers if weight > 0 and layer is not None]


def compute_edge_costs(
    terms: Sequence[tuple[float, CostLayer]], first: Cells, second: Cells
) -> tuple[Float[Array, "h w1"], Float[Array, "h1 w"]]:
    """W between every cell of a grid and its right neighbour, and between every cell and its upper one.

    first, second: the exemplar's cells that the two patches show there.
    """
    right, upper = [], []
    for share, layer in terms:
        d = layer.distances(first, second) * share
        g = (layer.slope[first] + layer.slope[second]) * share
        right.append((d[:, :-1] + d[:, 1:], g[:, :-1, 0] + g[:, 1:, 0], layer.unit))
        upper.append((d[:-1] + d[1:], g[:-1, :, 1] + g[1:, :, 1], layer.unit))
    return divide_terms(right), divide_terms(upper)


def divide_terms(parts: list[tuple[Array, Array, LayerScales]]) -> Array:
    """Eq. (graphcut_main) from each layer's weighed D and G."""
    difference = sum(d / unit.difference for d, _, unit in parts)
    return np.asarray(difference / (sum(g / unit.gradient for _, g, unit in parts) + EPS))


@dataclass(frozen=True)
class OverlapZone:
    """Where two patches overlap. keep, take: cells that must show the first and the second patch; a seam runs through
    the others. straight: cells that show the second patch if no seam is searched.
    """

    keep: Bool[Array, "h w"]
    take: Bool[Array, "h w"]
    straight: Bool[Array, "h w"]


@dataclass(frozen=True)
class Cut:
    """labels: which cells show the second patch. energy: the seam's cost."""

    labels: Bool[Array, "h w"]
    energy: float


def find_cut(
    right: Float[Array, "h w1"], upper: Float[Array, "h1 w"], first: Bool[Array, "h w"], second: Bool[Array, "h w"]
) -> Cut:
    """The cheapest partition of a grid into two patches, exactly (max-flow). All of it may be one patch.

    Args:
        right, upper: costs of parting a cell from its right and its upper neighbour.
        first, second: cells that must show the first and the second patch.
    Raises: ValueError: a cell is forced both ways, or a cost is negative or not finite.
    """
    if (first & second).any():
        raise ValueError("a cell is forced to both patches")
    largest = max(right.max(initial=0), upper.max(initial=0))
    if not (np.isfinite(largest) and min(right.min(initial=0), upper.min(initial=0)) >= 0):
        raise ValueError("seam costs must be finite and not negative")
    unit = QUANTA / largest if largest > 0 else 1.0  # quanta of a cost of one
    right, upper = (np.rint(costs * unit).astype(np.int64) for costs in (right, upper))
    graph = maxflow.GraphInt()
    nodes = graph.add_grid_nodes(first.shape)
    connect_neighbours(graph, nodes, right, upper)
    forced = int(right.sum() + upper.sum()) + 1  # more than any seam costs
    graph.add_grid_tedges(nodes, forced * first, forced * second)
    graph.maxflow()
    labels = graph.get_grid_segments(nodes)
    crossed = right[labels[:, 1:] != labels[:, :-1]].sum() + upper[labels[1:] != labels[:-1]].sum()
    return Cut(labels, int(crossed) / unit)


def connect_neighbours(graph: Any, nodes: Array, right: Array, upper: Array) -> None:
    """Edges from each node of a grid to its right and its upper neighbour, both ways."""
    east, north = np.zeros((3, 3)), np.zeros((3, 3))
    east[1, 2] = north[2, 1] = 1
    graph.add_grid_edges(nodes, np.pad(right, ((0, 0), (0, 1))), east, symmetric=True)
    graph.add_grid_edges(nodes, np.pad(upper, ((0, 1), (0, 0))), north, symmetric=True)
