"""Where seams run: the share of their length through ground of strong gradient, as a figure of the paper has it."""

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray as Array

from dav_gswt.tiles import energy, layout
from dav_gswt.tiles.build import TileSet
from dav_gswt_study.seams.placed_tiles import DetrendedExemplar

STRONG = (
    0.75  # quantile of the exemplar's gradients: what is above is strong; a seam drawn at random has a share of 1/4
)


def seam_density(tiles: TileSet, source: DetrendedExemplar) -> float:
    """Share of all cuts' edges between cells where either patch's gradient is among the exemplar's strongest quarter,
    counted by patch. Source: DAV-GSWT speaks of "seam density around object boundaries" without a formula.
    """
    colour = source.ground[..., :3]
    steep = np.linalg.norm(energy.compute_gradients(np.nan_to_num(colour, nan=float(np.nanmean(colour)))), axis=-1)
    strong = steep > np.quantile(steep, STRONG)
    parts = [_edge_steepness(strong, tiles.labels[t], tiles.shifts[t]) for t in range(len(tiles.labels))]
    edges = np.concatenate(parts)
    return float(edges.mean()) if len(edges) else 0.0


def _edge_steepness(strong: Bool[Array, "m m"], labels: UInt8[Array, "n n"], shift: Array) -> Float[Array, "edges"]:
    """For each end of each edge that is cut, whether what is shown there is steep."""
    rows, columns = layout.source_cells(labels, shift)
    here, values = strong[rows, columns].astype(float), []
    for axis in (0, 1):
        labels, here = (np.swapaxes(v, 0, axis) for v in (labels, here))
        cut = labels[1:] != labels[:-1]
        values += [here[:-1][cut], here[1:][cut]]
    return np.concatenate(values)
