"""What a seam costs: Eq. (graphcut_main) of the paper, made safe.

The cost of a seam between neighbouring cells s and t is

    W(s, t) = (gamma D_I + (1 - gamma) D_S) / (gamma G_I + (1 - gamma) G_S + EPS):

a difference is cheap where both patches have a strong gradient anyway. I is colour, S is what the ground is
(`semantics`). D(s, t) = d(s) + d(t), d the distance between what the two patches show in a cell; G(s, t) = the four
gradients along the edge, two of each patch; every D and G over its scale, frozen for the exemplar. gamma is high where
the ground is sure, low where it is doubted. What stands on the ground (`standing`) has a D of its own, and no G that
would make a cut through a shrub cheap: from above it looks like any dark ground, from the side half a shrub does not.
W is symmetric in the patches, finite, not negative, and 0 where they are
equal.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from dav_gswt.views.uncertainty import gamma

KINDS = ("none", "colour", "semantic", "semantic-nogamma")
OCCLUDER_WEIGHT = 2.0  # D of a thing that hides the ground, beside bare ground; in units of two random colours
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
    """A way to look at an exemplar: how far apart cells are, and how steep it is along x and along y in each."""

    slope: Float[Array, "h w 2"]
    unit: LayerScales

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
    """How much of each cell is hidden, in [0, 1], as a layer without gradient; None where nothing stands."""
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
    """A unit to measure by; what is the same everywhere, but for rounding, has none: 1 then."""
    return value if value > ROUNDING else 1.0


@dataclass(frozen=True)
class SeamEnergy:
    """How seams are cut (one of KINDS), and the layers that they are priced by; semantics are None for colour alone.

    slope: of gamma; 2 is the paper's. occluders: how much of each cell is hidden by what stands over it;
    None for nothing.
    """

    kind: str
    slope: float
    colours: CostLayer
    semantics: CostLayer | None
    occluders: CostLayer | None = None

    def gamma(self, doubt: float) -> float:
        """Weight of colour in the seams of a patch whose mean uncertainty (of 0 to 1) is `doubt`.

        Without semantics 1, `semantic-nogamma` 1/2. Raises: ValueError: doubt is NaN.
        """
        found = float(gamma(np.array([doubt], float), self.slope)[0])
        if self.semantics is None:
            return 1.0
        return 0.5 if self.kind == "semantic-nogamma" else found

    def terms(self, share: float) -> list[tuple[float, CostLayer]]:
        """The layers with their weights, at a weight of colour of `share`; one that weighs nothing is left out.

        What stands weighs the same however sure the ground is.
        """
        both = (share, self.colours), (1 - share, self.semantics)
        stand = [(OCCLUDER_WEIGHT, self.occluders)] if self.occluders is not None else []
        return [(weight, layer) for weight, layer in both if weight > 0] + stand


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
    return difference / (sum(g / unit.gradient for _, g, unit in parts) + EPS)
