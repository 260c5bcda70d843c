"""Outlines of objects, refined by a graph cut.

The cut separates an object from the ground around it (as GrabCut, Rother et al. 2004) by the colours
and heights of both, with borders where the map has an edge.
"""

from dataclasses import replace

import maxflow
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.cluster.vq import kmeans2
from scipy.ndimage import (
    binary_dilation,
    binary_fill_holes,
    binary_opening,
    distance_transform_edt,
    find_objects,
    label,
)
from scipy.special import logsumexp

from dav_gswt.materials.maps import GroundMaps, unite
from dav_gswt.materials.objects import BORDER, Footprint
from dav_gswt.tiles.energy import connect_neighbours

LEAST_AGREEMENT = 0.4  # IoU of a refined outline with the one before it: less is another thing
AROUND, LEAST_AROUND = 0.5, 4  # of the footprint's box, and cells: what the cut sees beside it, to each side
CORE = 0.5  # of the depth of a footprint: deeper cells are the object for sure
REACH = 0.5  # of that depth: ground farther from a footprint is none of the object
RING = 2  # cells between a footprint and the ring that is ground for sure
CLUSTERS, LEAST_CELLS = 3, 12  # normal distributions of a colour model, and cells that each is made of
HEIGHT_WEIGHT = 4.0  # CIELAB units that a cell's width of height counts as
NOISE = 3.0  # CIELAB units of spread that every distribution has at least
UNLIKELY = 10.0  # largest difference of two labels' costs
SMOOTHING = 3.0  # cost of a border between two cells that look alike, in units of log likelihood


def refine_footprints(maps: GroundMaps, footprints: list[Footprint]) -> list[Footprint]:
    """The footprints in their order, each with a closer outline where one is found, else as it is.

    A new outline is one piece, without holes, on known ground, apart from the border and from all other
    footprints, and has LEAST_AGREEMENT with the old one.
    """
    from skimage.color import rgb2lab  # here, not above: it takes half a second to load

    if not footprints:
        return []
    features = np.dstack([rgb2lab(maps.colour), HEIGHT_WEIGHT * maps.surface / maps.exemplar.spacing])
    objects = unite([each.cells for each in footprints], maps.known.shape)
    ground = maps.known & ~binary_dilation(objects, iterations=RING)  # what may be another object is no ground
    allowed = np.zeros_like(maps.known)
    inside = np.s_[BORDER : maps.cells - BORDER]
    allowed[inside, inside] = maps.known[inside, inside]
    taken, refined = np.sum([each.cells for each in footprints], axis=0, dtype=int), []
    for footprint in footprints:
        own = footprint.cells
        rows, columns = find_objects(own.astype(int))[0]
        margins = [max(LEAST_AROUND, round(AROUND * (side.stop - side.start))) for side in (rows, columns)]
        box = tuple(
            slice(max(0, s.start - more), s.stop + more) for s, more in zip((rows, columns), margins, strict=True)
        )
        new = None
        if (cut := cut_object(features[box], own[box], ground[box])) is not None:
            found = np.zeros_like(own)
            found[box] = cut
            new = accept_outline(own, found, allowed & (taken - own == 0))
        taken = taken - own + (own if new is None else new)
        refined.append(footprint if new is None else replace(footprint, cells=new))
    return refined


def accept_outline(
    before: Bool[Array, "m m"], found: Bool[Array, "m m"], allowed: Bool[Array, "m m"]
) -> Bool[Array, "m m"] | None:
    """The piece of a new outline, without threads, that has most of the old one; None where they do not agree."""
    pieces, _ = label(binary_opening(found & allowed, np.ones((2, 2), bool)))
    inside = np.bincount(pieces[before], minlength=1)
    inside[0] = 0
    if not inside.any():
        return None
    piece = binary_fill_holes(pieces == int(inside.argmax())) & allowed
    agreement = (piece & before).sum() / (piece | before).sum()
    return piece if agreement >= LEAST_AGREEMENT else None


def cut_object(
    features: Float[Array, "h w k"], own: Bool[Array, "h w"], ground: Bool[Array, "h w"]
) -> Bool[Array, "h w"] | None:
    """The object in a window by minimum cut; None where there are too few cells to learn from.

    own: its outline so far. ground: cells that are ground for sure. The window's border is no object.
    """
    depth = distance_transform_edt(np.pad(own, 1))[1:-1, 1:-1]
    core = depth > CORE * depth.max()
    if min(own.sum(), ground.sum()) < LEAST_CELLS:
        return None
    cost = _mixture_cost(features, features[own]) - _mixture_cost(features, features[ground])
    cost = np.clip(cost, -UNLIKELY, UNLIKELY)
    sure = 4 * (SMOOTHING + UNLIKELY)  # above all that a cell's borders can cost
    cost[core] = -sure
    cost[distance_transform_edt(~own) > max(REACH * depth.max(), RING)] = sure
    cost[[0, -1]] = cost[:, [0, -1]] = sure
    graph = maxflow.Graph[float]()
    nodes = graph.add_grid_nodes(own.shape)
    steps = [(np.diff(features, axis=axis) ** 2).sum(-1) for axis in (1, 0)]
    usual = 2 * max(float(np.mean(np.concatenate([step.ravel() for step in steps]))), 1e-9)
    # a border is cheap where neighbours differ
    connect_neighbours(graph, nodes, *(SMOOTHING * np.exp(-step / usual) for step in steps))
    graph.add_grid_tedges(nodes, np.maximum(-cost, 0), np.maximum(cost, 0))
    graph.maxflow()
    return ~graph.get_grid_segments(nodes)


def _mixture_cost(features: Float[Array, "h w k"], members: Float[Array, "n k"]) -> Float[Array, "h w"]:
    """Minus the log likelihood of a mixture of normal distributions, one for each cluster of the members."""
    number = int(np.clip(len(members) // LEAST_CELLS, 1, CLUSTERS))
    labels = np.zeros(len(members), int)
    if number > 1 and len(np.unique(members, axis=0)) > number:
        _, labels = kmeans2(members, number, minit="++", rng=0, missing="warn")
    parts = []
    for each in np.unique(labels):
        some = members[labels == each]
        away = features - some.mean(0)
        centred = some - some.mean(0)
        covariance = centred.T @ centred / len(some) + NOISE**2 * np.eye(members.shape[1])
        square = np.einsum("...i,ij,...j->...", away, np.linalg.inv(covariance), away)
        parts.append(np.log(len(some) / len(members)) - 0.5 * (square + np.linalg.slogdet(covariance)[1]))
    return -logsumexp(np.stack(parts), axis=0)
