"""The semantic layer of the seam energy: features of the segments that an exemplar divides into, seen from above.

A segment (a superpixel, or an object that a segmenter masks) has one vector of features: its mean colour and, with the
weights of LPIPS, the mean of AlexNet's features. Two cells are as far apart as their segments' features. The numbers of
segments are only names: other numbers for the same segments change nothing.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Float32, Int, Integer
from numpy import ndarray as Array
from scipy.sparse import csr_array
from scipy.spatial.distance import pdist, squareform

from dav_gswt.images import lpips_weights
from dav_gswt.threads import one_thread
from dav_gswt.tiles.energy import Cells, CostLayer, make_scales, safe_unit

SUPERPIXELS = 2000  # superpixels of an exemplar: their distances are a table
MIN_WIDTH = 6.0  # cells
SAME_KIND = 0.75  # share of neighbouring segments that are taken to be of one kind of ground
LAYERS = 2  # of AlexNet, the finest first: a value of the others covers more than a bush
PIXELS_PER_CELL = 2  # in AlexNet's input: its second layer has a value every 8 pixels
MARGIN = 32  # pixels of mirrored picture around the input: AlexNet pads with black


@dataclass(frozen=True)
class SemanticSource:
    """What the semantic layer is made of beside colours: weights of AlexNet (LPIPS), a folder with SAM 2; or None."""

    alexnet: lpips_weights.Weights | None = None
    sam2: Path | str | None = None


@dataclass(frozen=True)
class SemanticLayer(CostLayer):
    """Segments of the exemplar. distance: between two segments' features."""

    segments: Int[Array, "m m"]
    distance: Float32[Array, "s s"]

    def distances(self, first: Cells, second: Cells) -> Float[Array, "..."]:
        return self.distance[self.segments[first], self.segments[second]].astype(float)


def make_semantic_layer(colour: Float[Array, "m m 3"], source: SemanticSource) -> SemanticLayer:
    """Describe an exemplar. colour: in [0, 1].

    Raises: InputError: see `sam2.load_model`.
    """
    segments = segment_superpixels(colour, max(MIN_WIDTH, len(colour) / SUPERPIXELS**0.5))
    if source.sam2 is not None:
        from dav_gswt.tiles import sam2

        with one_thread():
            masks = sam2.predict_masks(sam2.load_model(source.sam2), colour)
        segments = overlay_masks(segments, masks)
    return describe_segments(segments, colour, source.alexnet)


def segment_superpixels(colour: Float[Array, "m m 3"], side: float) -> Int[Array, "m m"]:
    """SLIC (Achanta et al. 2012): segments of about side x side cells that keep to the edges of objects.

    The picture is blurred by a cell: otherwise grain breaks segments up, and SLIC merges the fragments into huge ones.
    """
    from skimage.segmentation import slic  # here, not above: it takes half a second to load

    return slic(colour, n_segments=max(1, round((len(colour) / side) ** 2)), start_label=0, sigma=1)


def overlay_masks(segments: Integer[Array, "m m"], masks: list[Array]) -> Int[Array, "m m"]:
    """Segments overlaid with masks, larger ones first: where two overlap, the smaller is the object on top."""
    out = np.array(segments, np.int64)
    for mask in sorted(masks, key=lambda mask: -mask.sum()):
        out[mask] = out.max() + 1
    return out


def describe_segments(
    segments: Integer[Array, "m m"], colour: Float[Array, "m m 3"], alexnet: lpips_weights.Weights | None
) -> SemanticLayer:
    """Describe an exemplar that has been segmented; the segments may have any numbers.

    Colour and AlexNet's features count alike: each over the root mean square distance of two cells drawn at random.
    """
    index, count = _renumber(segments)
    mean = csr_array((1 / count[index.ravel()], (index.ravel(), np.arange(index.size))))
    parts = [mean @ colour.reshape(-1, 3)] + ([_alexnet_features(mean, colour, alexnet)] if alexnet else [])
    parts = [part / safe_unit(_rms_distance(part, count)) for part in parts]
    distance = _subtract_kind(squareform(pdist(np.concatenate(parts, 1))), index).astype(np.float32)
    slope = np.stack([_feature_gradient(index.T, distance).T, _feature_gradient(index, distance)], -1)
    share = count / count.sum()
    spread = float(np.sqrt(share @ distance.astype(float) ** 2 @ share))
    return SemanticLayer(slope, make_scales(spread, slope), index, distance)


def _subtract_kind(distance: Float[Array, "s s"], index: Int[Array, "m m"]) -> Float[Array, "s s"]:
    """Distances less what two segments of one kind of ground differ by: sqrt(max(0, d^2 - d0^2)).

    Grain makes any two segments of the same sand differ in some of their many features. d0 is the quantile SAME_KIND of
    the distances of neighbouring segments: most neighbours are of one kind.
    """
    sides = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], 1) for a, b in sides])
    pairs = np.unique(np.sort(pairs[pairs[:, 0] != pairs[:, 1]], 1), axis=0)
    near = distance[pairs[:, 0], pairs[:, 1]]
    return np.sqrt(np.maximum(0, distance**2 - (np.quantile(near, SAME_KIND) ** 2 if len(near) else 0.0)))


def _renumber(segments: Integer[Array, "m m"]) -> tuple[Int[Array, "m m"], Int[Array, "s"]]:
    """Segments renumbered in order of appearance, so that sums run in the same order, and the cells of each."""
    _, first, index, count = np.unique(segments, return_index=True, return_inverse=True, return_counts=True)
    order = np.argsort(first)
    return np.argsort(order)[index].reshape(segments.shape), count[order]


def _rms_distance(features: Float[Array, "s k"], count: Int[Array, "s"]) -> float:
    """Root mean square distance of two cells drawn at random; count: cells of each segment."""
    away = features - count @ features / count.sum()
    return float(np.sqrt(2 * (count @ away**2).sum() / count.sum()))


def _feature_gradient(index: Int[Array, "n m"], distance: Float32[Array, "s s"]) -> Float[Array, "n m"]:
    """Change of the features per cell along the first axis, central differences as numpy.gradient's."""
    after, before = np.concatenate([index[1:], index[-1:]]), np.concatenate([index[:1], index[:-1]])
    steps = np.full(len(index), 2.0)
    steps[[0, -1]] = 1
    return distance[after, before] / steps[:, None]


def _alexnet_features(
    mean: csr_array, colour: Float[Array, "m m 3"], alexnet: lpips_weights.Weights
) -> Float[Array, "s k"]:
    """Mean over each segment of AlexNet's features, of unit length and weighed by channel as LPIPS does."""
    from dav_gswt.images import lpips  # here, not above: PyTorch takes seconds to load

    m = len(colour)
    with one_thread():
        large = lpips.resize_pictures(2 * colour[None].astype(np.float32) - 1, PIXELS_PER_CELL * m)[0]
        framed = np.pad(large, ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0)), mode="symmetric")
        layers = lpips.layers(framed[None], alexnet)[:LAYERS]
    middle = MARGIN + PIXELS_PER_CELL * (np.arange(m) + 0.5) - 0.5  # of each cell, in pixels
    parts = []
    for number, (layer, head) in enumerate(zip(layers, alexnet.heads, strict=False)):
        stride = 4 * 2**number
        size = layer.shape[-1]
        # value k is centred at pixel stride (k + 1) - 1
        near = np.clip(np.rint((middle + 1) / stride - 1), 0, size - 1).astype(int)
        values = layer[0].reshape(len(head), -1).T.astype(float)
        values /= np.linalg.norm(values, axis=1, keepdims=True) + 1e-10
        pick = (near[:, None] * size + near).ravel()
        share = mean @ csr_array((np.ones(m * m), (np.arange(m * m), pick)), shape=(m * m, size * size))
        parts.append(share @ (values * np.sqrt(np.maximum(head, 0))))
    return np.concatenate(parts, 1)
