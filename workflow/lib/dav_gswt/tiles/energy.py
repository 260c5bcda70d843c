"""What a seam costs: Eq. (graphcut_main) of the paper, in a form that is safe in floating point.

The cost of a seam between neighbouring cells s and t is

    W(s, t) = (gamma D_I + (1 - gamma) D_S) / (gamma G_I + (1 - gamma) G_S + EPS):

a difference is cheap where both patches have a strong gradient anyway. I is colour, S the semantic layer (`semantics`).
D(s, t) = d(s) + d(t), d the distance between what the two patches show in a cell; G(s, t) = the four gradients along
the edge, two of each patch; every D and G is divided by its scale, frozen for the exemplar. gamma is high where the
ground is certain. Cells hidden by occluders (`make_occluder_layer`) have a D of their own and no G: otherwise a cut
through a shrub would be cheap. W is symmetric in the patches, finite, not negative, and 0 where they are equal.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.views.uncertainty import gamma

KINDS = ("none", "colour", "semantic", "semantic-nogamma")
OCCLUDER_WEIGHT = 2.0  # D of a hidden cell beside bare ground, in units of two random colours
EPS = 1.0  # of the mean gradient: with less, a cut through a bush (steep everywhere) is as cheap as one through sand
ROUNDING = 1e-9  # of colours, which are about 1

Cells = tuple[Array, Array]  # rows and columns of the exemplar's cells, of any one shape


@dataclass(frozen=True)
class LayerScales:
    """Units of difference and gradient, frozen once for an exemplar."""

    difference: float
    gradient: float


@runtime_checkable
class CostLayer(Protocol):
    """A description of an exemplar: distances between cells, the gradient along x and y in each, and their scales."""

    @property
    def slope(self) -> Float[Array, "h w 2"]: ...

    @property
    def unit(self) -> LayerScales: ...

    def distances(self, first: Cells, second: Cells) -> Float[Array, "..."]: ...


@dataclass(frozen=True)
class ColourLayer:
    """Colours of the exemplar's cells, and their gradients; cells are as far apart as their colours (2-norm)."""

    values: Float[Array, "h w c"]

    slope: Float[Array, "h w 2"]
    unit: LayerScales

    def distances(self, first: Cells, second: Cells) -> Float[Array, "..."]:
        return np.linalg.norm(self.values[first] - self.values[second], axis=-1)


def make_colour_layer(values: Float[Array, "h w c"]) -> ColourLayer:
    return ColourLayer(values, compute_gradients(values), measure_scales(values))


def make_occluder_layer(cover: Float[Array, "h w"]) -> ColourLayer | None:
    """Share of each cell that occluders hide, in [0, 1], as a layer without gradient; None where nothing is hidden."""
    if not cover.any():
        return None
    return ColourLayer(cover[..., None], np.zeros((*cover.shape, 2)), LayerScales(1.0, 1.0))


def compute_gradients(values: Float[Array, "h w c"]) -> Float[Array, "h w 2"]:
    """Change per cell along x and along y (central differences, 2-norm over channels)."""
    return np.stack([np.linalg.norm(np.gradient(values, axis=axis), axis=-1) for axis in (1, 0)], -1)


def measure_scales(values: Float[Array, "h w c"]) -> LayerScales:
    """Scales of an exemplar: the root mean square of D between two places drawn at random, and the mean of G."""
    spread = float(np.sqrt(2 * values.reshape(-1, values.shape[-1]).var(0).sum()))
    return make_scales(spread, compute_gradients(values))


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
        kind: one of KINDS.
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
        weight = float(gamma(np.array([uncertainty], float), self.slope)[0])
        if self.semantics is None:
            return 1.0
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
