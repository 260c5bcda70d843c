"""What comes back with every tile, against the variance of the tiles' mean picture worked out in full."""

import numpy as np
import pytest

from dav_gswt.tiles import energy, layout, patches, search


def exemplar(seed=0, m=40):
    return np.random.default_rng(seed).random((m, m, 3))


def power(picture):
    """Of a mean tile, per sample: its squares, and those of its rows' and columns' means, LINES times."""
    squares = [(part**2).sum(-1).mean() for part in (picture, picture.mean(0), picture.mean(1))]
    return squares[0] + patches.LINE_WEIGHT * (squares[1] + squares[2])


def own(picture):
    """A patch's own square, which is not charged."""
    return (picture**2).sum(-1).mean()


def test_charges_sum_to_the_power_of_what_comes_back_but_for_the_patches_own():
    shown = patches.start_overlay(exemplar(), 16, (16, 16))
    places, total = np.array([[0, 0], [8, 4], [20, 24]]), 0.0
    for place in places:
        total += shown.compute_costs(shown.crop_all(place[None]))[0]
        shown = shown.with_patch(place)
    tiles = [shown.ground[y : y + 16, x : x + 16] for x, y in places]
    assert total == pytest.approx(power(np.sum(tiles, 0)) - sum(own(tile) for tile in tiles))


def test_a_strip_is_no_better_for_being_barer_than_the_ground():
    rng = np.random.default_rng(2)
    colour = np.full((60, 60, 3), 0.5)
    colour[20:] -= 0.2 * (rng.random((40, 60, 1)) < 0.1)  # flowers on two thirds of it
    colour[40:44, 4:8] = 0
    plan = layout.Layout(60, 1, 20, 2, 3)
    guide = patches.make_guidance(colour, np.zeros((60, 60)), np.zeros((60, 60)), plan)
    places = np.array([(x, y) for x in range(8, 56, 4) for y in range(0, 41, 5)] + [(4, 36)])
    odd = patches.patch_saliency(guide, places, (4, 20))
    plain = patches.patch_means(patches.compute_saliency(guide), places, (4, 20))
    bare = places[:, 1] == 0
    assert plain[bare].max() < np.median(plain)
    assert set(odd[bare]) == {odd.min()} == {np.median(plain)}
    assert odd[-1] > 2 * odd.min()  # a landmark is dear


def test_a_landmark_is_what_stands_out_of_its_surroundings_not_a_shade_or_grain():
    y, x = np.mgrid[:120, :120]
    maps = np.random.default_rng(0).normal(0, 0.02, (120, 120, 2)) + 0.05 * np.sin(x / 40)[..., None]
    maps[(x - 30) ** 2 + (y - 80) ** 2 < 20, 1] += 0.5
    found = patches.find_landmarks(maps, 60)
    spot = (x - 30) ** 2 + (y - 80) ** 2 < 300
    assert found[80, 30] > 0 and (found[~spot] > 0).mean() < 0.01
    assert found.mean() == pytest.approx(1)
    assert not patches.find_landmarks(np.ones((120, 120, 2)), 60).any()


@pytest.mark.parametrize("seed", range(3))
def test_hardly_a_landmark_lies_in_what_all_tiles_share(seed):
    rng, m = np.random.default_rng(seed), 160
    colour = 0.5 + 0.05 * rng.normal(size=(m, m, 1)).repeat(3, 2)
    spots = [(24 + 28 * (k % 5), 24 + 28 * (k // 5)) for k in range(25)]
    y, x = np.mgrid[:m, :m]
    for place in spots:
        colour[(x - place[0]) ** 2 + (y - place[1]) ** 2 < 7] += 0.4
    plan = layout.Layout(m, 1, 60, 6, 9)
    flat = np.zeros((m, m))
    guide = patches.make_guidance(colour, flat, flat, plan)
    energy_of = energy.SeamEnergy("colour", 2.0, energy.make_colour_layer(colour), None)
    problem = search.SearchProblem(plan, guide, energy_of, 300, 2)
    found = search.search_patches(problem, 1, np.random.default_rng(seed))
    labels, shifts = found.labels, [layout.label_shifts(plan, found.places, tile) for tile in range(16)]
    shown = [guide.landmarks[layout.source_cells(*pair)] > 0 for pair in zip(labels, shifts, strict=True)]
    frame, centre = (
        np.mean([marks[pick(own)].mean() for marks, own in zip(shown, labels, strict=True)])
        for pick in (lambda own: own > 0, lambda own: own == 0)
    )
    assert frame < 0.2 * centre
