"""Outlines of objects, refined: by a segmenter that is prompted with an object's box, or by a graph cut.

The cut separates an object from the ground around it (as GrabCut, Rother et al. 2004) by the colours
and heights of both, with borders where the map has an edge.
"""

from collections.abc import Callable
from dataclasses import replace

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
from dav_gswt.materials.mobilesam import Segmenter
from dav_gswt.materials.objects import BORDER, Footprint

Finder = Callable[[Array], Array | None]  # a footprint's cells to those of what is there, or None

LEAST_AGREEMENT = 0.4  # IoU of a refined outline with the one before it: less is another thing
GROWN = 1  # cells that a prompt is wider than the footprint, to each side
LEAST_REST = 0.1  # of a footprint: what an outline left out may be another object
REST_WIDTH = 1 / 6  # of the root of the footprint's area: narrower parts of such a rest do not count
LEAST_WIDTH = 4  # cells, of such an object
AROUND, LEAST_AROUND = 0.5, 4  # of the footprint's box, and cells: what the cut sees beside it, to each side
CORE = 0.5  # of the depth of a footprint: deeper cells are the object for sure
REACH = 0.5  # of that depth: ground farther from a footprint is none of the object
RING = 2  # cells between a footprint and the ring that is ground for sure
CLUSTERS, LEAST_CELLS = 3, 12  # normal distributions of a colour model, and cells that each is made of
HEIGHT_WEIGHT = 4.0  # CIELAB units that a cell's width of height counts as
NOISE = 3.0  # CIELAB units of spread that every distribution has at least
UNLIKELY = 10.0  # largest difference of two labels' costs
SMOOTHING = 3.0  # cost of a border between two cells that look alike, in units of log likelihood


def refine_footprints(
    maps: GroundMaps, footprints: list[Footprint], segmenter: Segmenter | None = None
) -> list[Footprint]:
    """The footprints in their order, each with a closer outline where one is found, else as it is.

    A new outline is one piece, without holes, on known ground, apart from the border and from all other
    footprints, and has LEAST_AGREEMENT with the old one. A segmenter may find that a footprint holds
    several objects: the others come last. segmenter: None: by graph cut.
    """
    if not footprints:
        return []
    find = _prompt_segmenter(maps, segmenter) if segmenter else _cut_objects(maps, footprints)
    allowed = np.zeros_like(maps.known)
    inside = np.s_[BORDER : maps.cells - BORDER]
    allowed[inside, inside] = maps.known[inside, inside]
    taken, refined = np.sum([each.cells for each in footprints], axis=0, dtype=int), []
    for footprint in footprints:
        own = footprint.cells
        new = accept_outline(own, find(own), allowed & (taken - own == 0))
        taken = taken - own + (own if new is None else new)
        refined.append(footprint if new is None else replace(footprint, cells=new))
    rests = [rest for pair in zip(footprints, refined, strict=True) for rest in _list_rests(*pair)]
    for rest in rests if segmenter else []:
        new = accept_outline(rest.cells, find(rest.cells), allowed & (taken == 0))
        if new is not None and binary_opening(new, np.ones((LEAST_WIDTH, LEAST_WIDTH), bool)).any():
            taken = taken + new
            refined.append(replace(rest, cells=new))
    return refined


def accept_outline(
    before: Bool[Array, "m m"], found: Bool[Array, "m m"] | None, allowed: Bool[Array, "m m"]
) -> Bool[Array, "m m"] | None:
    """The piece of a new outline, without threads, that has most of the old one; None where they do not agree."""
    if found is None:
        return None
    pieces, _ = label(binary_opening(found & allowed, np.ones((2, 2), bool)))
    inside = np.bincount(pieces[before], minlength=1)
    inside[0] = 0
    if not inside.any():
        return None
    piece = binary_fill_holes(pieces == int(inside.argmax())) & allowed
    agreement = (piece & before).sum() / (piece | before).sum()
    return piece if agreement >= LEAST_AGREEMENT else None


def _list_rests(old: Footprint, new: Footprint) -> list[Footprint]:
    """Pieces of a footprint that its new outline left out, where they may be other objects."""
    area = int(old.cells.sum())
    width = max(3, round(REST_WIDTH * area**0.5))
    pieces, number = label(binary_opening(old.cells & ~new.cells, np.ones((width, width), bool)))
    parts = [pieces == piece for piece in range(1, number + 1)]
    return [replace(old, cells=part) for part in parts if part.sum() >= LEAST_REST * area]


def _prompt_segmenter(maps: GroundMaps, segmenter: Segmenter) -> Finder:
    """Finds what is in a footprint's box. The segmenter is shown the map with north up."""
    find_in_box = segmenter.open_picture(maps.colour[::-1])

    def find(cells: Bool[Array, "m m"]) -> Bool[Array, "m m"] | None:
        rows, columns = np.nonzero(cells[::-1])
        low = np.array([columns.min(), rows.min()]) - GROWN
        high = np.array([columns.max(), rows.max()]) + 1 + GROWN
        mask = find_in_box(np.clip(np.concatenate([low, high]), 0, maps.cells).astype(float))
        return None if mask is None else mask[::-1]

    return find


def _cut_objects(maps: GroundMaps, footprints: list[Footprint]) -> Finder:
    """Cuts an object out of its surroundings; what may be another object is not taken for ground."""
    from skimage.color import rgb2lab  # here, not above: it takes half a second to load

    relief = maps.surface / maps.exemplar.spacing
    features = np.dstack([rgb2lab(maps.colour), HEIGHT_WEIGHT * relief])
    objects = unite([each.cells for each in footprints], maps.known.shape)
    ground = maps.known & ~binary_dilation(objects, iterations=RING)

    def find(cells: Bool[Array, "m m"]) -> Bool[Array, "m m"] | None:
        own, found = find_objects(cells.astype(int))[0], np.zeros_like(cells)
        margins = [max(LEAST_AROUND, round(AROUND * (side.stop - side.start))) for side in own]
        box = tuple(slice(max(0, s.start - more), s.stop + more) for s, more in zip(own, margins, strict=True))
        inside = cut_object(features[box], cells[box], ground[box])
        if inside is None:
            return None
        found[box] = inside
        return found

    return find


def cut_object(
    features: Float[Array, "h w k"], own: Bool[Array, "h w"], ground: Bool[Array, "h w"]
) -> Bool[Array, "h w"] | None:
    """The object in a window by minimum cut; None where there are too few cells to learn from.

    own: its outline so far. ground: cells that are ground for sure. The window's border is no object.
    """
    import maxflow

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
    for axis, step in zip((1, 0), steps, strict=True):  # a border is cheap where neighbours differ
        pad, structure = np.zeros((2, 2), int), np.zeros((3, 3))
        pad[axis, 1], structure[1 + (axis == 0), 1 + (axis == 1)] = 1, 1
        weights = np.pad(SMOOTHING * np.exp(-step / usual), pad)
        graph.add_grid_edges(nodes, weights, structure, symmetric=True)
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
