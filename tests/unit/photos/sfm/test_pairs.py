import numpy as np

from dav_gswt.photos.sfm.pairs import compare_descriptions, describe_photos, select_pairs


def walk(photos, rng, overlap=0.7, each=300):
    """Features of photos along a walk: neighbours share most of theirs."""
    pool = rng.integers(0, 120, (each * photos, 128)).astype(np.uint8)
    step = int(each * (1 - overlap))
    shots = [pool[i * step : i * step + each].astype(int) for i in range(photos)]
    return [np.clip(s + rng.integers(-4, 5, s.shape), 0, 255).astype(np.uint8) for s in shots]


def test_few_photos_are_all_matched():
    assert len(select_pairs([np.zeros((0, 128), np.uint8)] * 8, 12, 0)) == 28


def test_photos_that_overlap_are_matched_whatever_their_names():
    rng = np.random.default_rng(0)
    shots, order = walk(30, rng), rng.permutation(30)
    found = set(select_pairs([shots[i] for i in order], 6, 0))
    assert all(i < j for i, j in found) and len(found) < 30 * 29 / 2 * 0.6
    place = np.argsort(order)
    neighbours = {tuple(sorted((int(place[i]), int(place[i + 1])))) for i in range(29)}
    assert len(neighbours & found) >= 28


def test_all_photos_hang_together():
    rng = np.random.default_rng(1)
    apart = [rng.integers(0, 255, (200, 128)).astype(np.uint8) for _ in range(25)]
    found = select_pairs(apart, 1, 0)
    group = {0}
    for _ in range(25):
        group |= {k for pair in found if set(pair) & group for k in pair}
    assert group == set(range(25))


def test_the_choice_repeats_and_photos_without_features_do_no_harm():
    shots = [*walk(24, np.random.default_rng(2)), np.zeros((0, 128), np.uint8)]
    one, two = select_pairs(shots, 5, 3), select_pairs(shots, 5, 3)
    assert one == two
    assert np.isfinite(describe_photos(shots, 3)).all()
    assert np.isfinite(describe_photos([np.zeros((0, 128), np.uint8)] * 3, 0)).all()


def test_a_photo_looks_like_itself():
    alike = compare_descriptions(describe_photos(walk(5, np.random.default_rng(3)), 0))
    np.testing.assert_allclose(np.diag(alike), 1, atol=1e-5)
    assert alike[0, 1] > alike[0, 4]
