"""The hash of cells, as chance: counts, avalanche, lags, symmetries, and cells far out.

Bounds are six standard deviations of the binomial distribution, for seeds that stay."""

import numpy as np
import pytest
from scipy import stats

from dav_gswt.terrain.choice import hash_cell, tiles_at
from dav_gswt.terrain.heights import Hills

SALTS = (0, 1, 7, 0xDEADBEEF)
FAR = (0, 10**6, -(2**30))
MIRRORS = {"point": (-1, -1), "west to east": (-1, 1), "south to north": (1, -1)}


def cells(side=200, west=1, south=1):
    return np.meshgrid(west + np.arange(side, dtype=np.int64), south + np.arange(side, dtype=np.int64))


def within(share, chance, count):
    return abs(share - chance) < 6 * np.sqrt(chance * (1 - chance) / count)


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("salt", SALTS)
def test_bytes_of_the_hash_are_uniform(salt, far):
    i, j = cells(256, far, -far)
    for axis in range(4):
        bits = hash_cell(i, j, axis, salt)
        for shift in (0, 8, 16, 24):
            counts = np.bincount((bits >> shift & 255).ravel(), minlength=256)
            assert stats.chisquare(counts).pvalue > 1e-6


@pytest.mark.parametrize("coordinate", ["i", "j"])
def test_each_bit_of_a_coordinate_flips_half_the_bits_of_the_hash(coordinate):
    rng = np.random.default_rng(0)
    i, j = rng.integers(-(2**31), 2**31, (2, 20000))
    here = hash_cell(i, j, 0, 5)
    for bit in range(32):
        there = hash_cell(i ^ 1 << bit, j, 0, 5) if coordinate == "i" else hash_cell(i, j ^ 1 << bit, 0, 5)
        flips = (here ^ there)[:, None] >> np.arange(32) & 1
        assert all(within(share, 0.5, len(i)) for share in flips.mean(0))


@pytest.mark.parametrize("far", FAR)
@pytest.mark.parametrize("axis", range(3))
def test_edges_do_not_follow_their_neighbours(axis, far):
    i, j = cells(300, far, far)
    bits = hash_cell(i, j, axis, 3) & 1
    for di in range(-8, 9):
        for dj in range(9):
            if (di, dj) != (0, 0):
                same = bits == hash_cell(i + di, j + dj, axis, 3) & 1
                assert within(same.mean(), 0.5, same.size), (di, dj)


@pytest.mark.parametrize("mirror", MIRRORS)
@pytest.mark.parametrize("axis", range(4))
def test_no_mirror_image_has_the_same_hash(axis, mirror):
    (a, b), (i, j) = MIRRORS[mirror], cells(500)
    for salt in SALTS:
        same = hash_cell(i, j, axis, salt) == hash_cell(a * i, b * j, axis, salt)
        assert same.mean() < 1e-4


def test_the_diagonal_is_no_mirror():
    i, j = cells(500)
    other = i != j
    assert (hash_cell(i, j, 2, 1) == hash_cell(j, i, 2, 1))[other].mean() < 1e-4


@pytest.mark.parametrize("mirror", MIRRORS)
@pytest.mark.parametrize("variants", [1, 2, 3])
def test_a_mirrored_cell_has_the_same_tile_by_chance_alone(mirror, variants):
    (a, b), (i, j) = MIRRORS[mirror], cells(400, 3, 3)
    tiles, mirrored = tiles_at(i, j, 7, variants), tiles_at(a * i, b * j, 7, variants)
    # a mirrored cell's colours are the hashes of other edges: 1 in 16, and 1 in `variants` centres
    assert within((tiles == mirrored).mean(), 1 / (16 * variants), tiles.size / 4)


@pytest.mark.parametrize("mirror", MIRRORS)
def test_hills_are_not_mirrored(mirror):
    a, b = MIRRORS[mirror]
    x, y = (0.37 + 0.61 * np.arange(1, 201)[k] for k in np.meshgrid(np.arange(200), np.arange(200)))
    for salt in SALTS:
        hills = Hills(1.0, 1.0, 1, salt)
        here, there = hills.at(x.ravel(), y.ravel())[0], hills.at(a * x.ravel(), b * y.ravel())[0]
        assert abs(np.corrcoef(here, there)[0, 1]) < 0.05
