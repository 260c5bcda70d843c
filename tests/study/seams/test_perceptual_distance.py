"""Seam-LPIPS: vectors apart by LPIPS, banks without the own source, floors that equal cuts of equal patches."""

import numpy as np
import pytest
from fixtures import lpips_arrays, seams

from dav_gswt.errors import InputError
from dav_gswt.images import lpips
from dav_gswt.study.seams import perceptual_distance

WEIGHTS = lpips_arrays.random()


@pytest.fixture(scope="module")
def pictures():
    return np.random.default_rng(1).random((5, 48, 48, 3)).astype(np.float32)


def test_distances_of_vectors_are_lpips(pictures):
    vectors, _ = perceptual_distance.embed_images(pictures, WEIGHTS)
    found = perceptual_distance.pairwise_distances(vectors[:2], vectors)
    for a in range(2):
        first = np.repeat(pictures[a : a + 1], 5, 0)
        expected = lpips.distance(2 * first - 1, 2 * pictures - 1, WEIGHTS)
        np.testing.assert_allclose(found[a], expected, rtol=1e-4, atol=1e-6)  # float32 features


def test_distances_are_the_same_either_way_round(pictures):
    vectors, _ = perceptual_distance.embed_images(pictures, WEIGHTS)
    both = perceptual_distance.pairwise_distances(vectors, vectors)
    np.testing.assert_allclose(both, both.T, atol=1e-12)


def test_what_masks_see_sums_to_one(pictures):
    _, shapes = perceptual_distance.embed_images(pictures[:1], WEIGHTS)
    left = np.random.default_rng(2).random((48, 48)).astype(np.float32)
    seen = perceptual_distance.pool_masks(np.stack([left, 1 - left]), shapes)
    np.testing.assert_allclose(seen.sum(0), 1, atol=1e-6)
    assert seen.shape[1] == sum(np.prod(shape) for shape in shapes)


def test_of_equal_patches_the_floor_is_the_cut(pictures):
    """Two patches that show the same, whatever of each is seen: nobody can tell that there is a cut."""
    vectors, shapes = perceptual_distance.embed_images(pictures, WEIGHTS)
    near = perceptual_distance.find_nearest(
        perceptual_distance.pairwise_distances(vectors[:1], vectors[1:]), np.ones(4, bool)
    )[0]
    bank = vectors[1:][near]
    cut = float(perceptual_distance.pairwise_distances(vectors[:1], bank).mean())
    _, _, patch = seams.halves()
    masks = np.stack([patch == 0, patch == 1]).astype(np.float32)
    floor = perceptual_distance.compute_floor(
        vectors[[0, 0]], [bank, bank], perceptual_distance.pool_masks(masks, shapes)
    )
    assert floor == pytest.approx(cut, rel=1e-5)


def test_a_step_in_a_crop_takes_it_from_the_bank():
    """The bank holds other grains of the same texture: a step of brightness is like none of them."""
    rng = np.random.default_rng(3)
    bank = np.clip(0.5 + 0.1 * rng.normal(size=(12, 48, 48, 3)), 0, 1).astype(np.float32)
    crops = np.stack([seams.halves(step)[1] for step in (0.0, 0.15, 0.3)])
    vectors, _ = perceptual_distance.embed_images(np.concatenate([crops, bank]), WEIGHTS)
    apart = np.sort(perceptual_distance.pairwise_distances(vectors[:3], vectors[3:]), axis=1)[
        :, : perceptual_distance.NEIGHBOURS
    ].mean(1)
    assert apart[0] < apart[1] < apart[2]


def test_the_bank_leaves_out_the_own_source():
    box = lambda x, y: [[x, y], [x + 11, y + 11]]  # noqa: E731
    own = np.array([box(0, 0), box(50, 50)])
    bank = np.array([box(0, 0), box(11, 11), box(12, 0), box(0, 12), box(55, 45), box(30, 30)])
    assert perceptual_distance.exclude_overlaps(own, bank).tolist() == [False, False, True, True, False, True]


def test_nearest_takes_only_what_is_allowed():
    apart = np.array([[0.1, 0.2, 0.3, 0.4]])
    assert perceptual_distance.find_nearest(apart, np.array([False, True, True, True]), 2).tolist() == [[1, 2]]
    with pytest.raises(InputError, match="too few crops that do not overlap"):
        perceptual_distance.find_nearest(apart, np.array([False, True, False, False]), 2)
