import numpy as np
import pytest
from fixtures import lpips_arrays

from dav_gswt.errors import InputError
from dav_gswt.images import lpips
from dav_gswt_study.seams import perceptual_distance

WEIGHTS = lpips_arrays.random()
PICTURES = np.random.default_rng(1).random((5, 48, 48, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def embedded():
    return perceptual_distance.embed_images(PICTURES, WEIGHTS)


def test_distances_of_vectors_are_lpips(embedded):
    found = perceptual_distance.pairwise_distances(embedded[0][:2], embedded[0])
    for a in range(2):
        first = np.repeat(PICTURES[a : a + 1], 5, 0)
        expected = lpips.distance(2 * first - 1, 2 * PICTURES - 1, WEIGHTS)
        np.testing.assert_allclose(found[a], expected, rtol=1e-4, atol=1e-6)  # float32 features


def test_the_bank_leaves_out_the_own_source_and_nearest_takes_only_what_is_allowed():
    def boxes(*places):
        return np.array([[[x, y], [x + 11, y + 11]] for x, y in places])

    own, bank = boxes((0, 0), (50, 50)), boxes((0, 0), (11, 11), (12, 0), (0, 12), (55, 45), (30, 30))
    assert perceptual_distance.exclude_overlaps(own, bank).tolist() == [False, False, True, True, False, True]
    apart = np.array([[0.1, 0.2, 0.3, 0.4]])
    assert perceptual_distance.find_nearest(apart, np.array([False, True, True, True]), 2).tolist() == [[1, 2]]
    with pytest.raises(InputError, match="too few crops that do not overlap"):
        perceptual_distance.find_nearest(apart, np.array([False, True, False, False]), 2)
