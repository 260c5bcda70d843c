"""Selection of the pairs of photos to match: those whose global descriptors are similar.

A photo's descriptor is VLAD of its SIFT features over a small vocabulary learned from the set itself (Jegou et al.
2010, with RootSIFT and intra-normalisation: Arandjelovic and Zisserman 2013), so that nothing is downloaded. A photo is
matched with its nearest neighbours, with those before and after it by name, and along a spanning tree of all photos.
"""

import numpy as np
from jaxtyping import Float, Float32, UInt8
from numpy import ndarray as Array
from scipy.cluster.vq import kmeans2, vq
from scipy.sparse.csgraph import minimum_spanning_tree

WORDS = 48
SAMPLE = 20_000  # features that the vocabulary is learned from
EACH = 1200  # features of a photo that describe it
NEXT = 2  # photos before and after a photo by name: flights are named in their order
ALL = 20  # photos up to which every pair is matched


def select_pairs(descriptors: list[UInt8[Array, "_ 128"]], neighbours: int, seed: int) -> list[tuple[int, int]]:
    """Pairs i < j of photos to match. neighbours: of each photo; every pair is taken where there are few photos."""
    count = len(descriptors)
    if count <= ALL or neighbours >= count - 1:
        return [(i, j) for i in range(count) for j in range(i + 1, count)]
    alike = compare_descriptions(describe_photos(descriptors, seed))
    pairs = {(i, i + step) for step in range(1, NEXT + 1) for i in range(count - step)}
    for i in range(count):
        order = np.argsort(-alike[i], kind="stable")
        near = [int(j) for j in order if j != i][:neighbours]
        pairs |= {(min(i, j), max(i, j)) for j in near}
    tree = minimum_spanning_tree(np.triu(2.0 - alike, 1)).tocoo()  # positive, so that no edge counts as missing
    return sorted(pairs | {(min(i, j), max(i, j)) for i, j in zip(tree.row.tolist(), tree.col.tolist(), strict=True)})


def describe_photos(descriptors: list[UInt8[Array, "_ 128"]], seed: int) -> Float32[Array, "photos d"]:
    """A unit vector for each photo; zero for one without features."""
    rng = np.random.default_rng(seed)
    some = [_root_features(_thin_evenly(d, EACH)) for d in descriptors]
    pooled = np.concatenate(some)
    if len(pooled) < WORDS:
        return np.zeros((len(some), WORDS * 128), np.float32)
    sample = pooled[rng.choice(len(pooled), min(SAMPLE, len(pooled)), replace=False)]
    words, _ = kmeans2(sample, WORDS, minit="++", rng=np.random.default_rng(seed))
    return np.stack([_aggregate_features(photo, words) for photo in some])


def compare_descriptions(described: Float32[Array, "photos d"]) -> Float[Array, "photos photos"]:
    """Cosines, -1 to 1."""
    return np.clip(described.astype(float) @ described.T.astype(float), -1, 1)


def _aggregate_features(features: Float32[Array, "n 128"], words: Float[Array, "w 128"]) -> Float32[Array, "d"]:
    """Per word the sum of what its features differ from it, each word's of length 1, and the whole."""
    out = np.zeros((len(words), 128))
    if len(features):
        which, _ = vq(features, words)
        np.add.at(out, which, features - words[which])
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-12)
    return (out / max(np.linalg.norm(out), 1e-12)).ravel().astype(np.float32)


def _root_features(features: UInt8[Array, "n 128"]) -> Float32[Array, "n 128"]:
    """Square roots of features that sum to 1: their distance is then Hellinger's."""
    f = features.astype(np.float32)
    return np.sqrt(f / np.maximum(f.sum(1, keepdims=True), 1e-12))


def _thin_evenly(rows: Array, count: int) -> Array:
    return rows if len(rows) <= count else rows[np.linspace(0, len(rows) - 1, count).astype(int)]
