from dataclasses import fields as members
from dataclasses import replace

import numpy as np
import pytest
import torch
from fixtures.tile_sets import report_of

from dav_gswt.field import SH0, GaussianField
from dav_gswt.prior.networks import Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import CENTRE, EDGES, Exemplar, W
from dav_gswt_study.refine import build, limits, repair
from dav_gswt_study.refine.build import Options, UncutGround

N, SPACING, STEP, EDGE = 24, 0.25, 0.1, 8
SIDE = N * SPACING
FEW = Options(views=4, width=24, reach=5.0, fit=8, colour=0.1, opacity=0.3, position=0.2)


def ground(n, spacing, colour, west=0.0, south=0.0):
    """One disc a cell, of the colours of an array [y, x, 3]."""
    y, x = np.mgrid[:n, :n]
    means = np.stack([west + (x + 0.5) * spacing, south + (y + 0.5) * spacing, 0 * x], -1).reshape(-1, 3)
    k = n * n
    scales = np.tile(np.log(np.float32(spacing * np.array([0.6, 0.6, 0.1]))), (k, 1))
    quats = np.tile(np.float32([1, 0, 0, 0]), (k, 1))
    sh = ((colour.reshape(-1, 1, 3) - 0.5) / SH0).astype(np.float32)
    unsure, is_ground = np.zeros(k, np.float32), np.ones(k, bool)
    return GaussianField(means.astype(np.float32), scales, quats, np.full(k, 4, np.float32), sh, unsure, is_ground)


def labels():
    out = np.full((N, N), W, np.uint8)
    out[EDGE:-EDGE, EDGE:-EDGE] = CENTRE
    return out


def brightness(n):
    inside = (labels() == CENTRE).reshape(n, N // n, n, N // n).mean((1, 3))
    grain = 0.01 * np.sin(np.arange(n * n)).reshape(n, n, 1)
    return 0.4 + grain + STEP * inside[..., None] * np.ones(3)


def tile_set():
    finest, coarse = (ground(n, SIDE / n, brightness(n)) for n in (N, N // 2))
    shifts = np.zeros((EDGES, 9, 2), int)
    levels = [[finest] * EDGES, [coarse] * EDGES]
    return TileSet(SIDE, SPACING, levels, np.stack([labels()] * EDGES), shifts, np.zeros(EDGES), report_of(N, 8))


UNCUT = UncutGround(ground(48, SPACING, np.full((48, 48, 3), 0.4), -3.0, -3.0), Exemplar(-3.0, -3.0, SPACING, 48))


def truth(condition, near):
    """The ground without the step: as bright everywhere as outside."""
    return np.where(condition.colour > 0.44, np.float32(-STEP), np.float32(0)) * np.ones(3, np.float32)


@pytest.fixture(scope="module")
def mended():
    return build.refine_tiles(tile_set(), UNCUT, FEW, truth, 32)


def same(one: GaussianField, two: GaussianField) -> bool:
    return all(getattr(one, f.name).tobytes() == getattr(two, f.name).tobytes() for f in members(GaussianField))


def test_where_nothing_is_repaired_or_cut_every_level_keeps_its_bytes():
    whole = replace(tile_set(), labels=np.full((EDGES, N, N), CENTRE, np.uint8))
    for before, by in ((tile_set(), lambda condition, near: 0 * condition.colour), (whole, truth)):
        found = build.refine_tiles(before, UNCUT, FEW, by, 32)
        for one, two in zip(found.fields, before.fields, strict=True):
            assert all(same(a, b) for a, b in zip(one, two, strict=True))
        assert all(tile["changed"] == 0 for tile in found.report["refined"]["tiles"])


def test_a_step_of_brightness_becomes_smaller_in_every_level(mended):
    for level, n in ((0, N), (1, N // 2)):
        edge, wide = EDGE * n // N, 2 * n // N
        steps = []
        for tiles in (tile_set(), mended):
            colour = tiles.fields[level][5].base_colours[:, 0].reshape(n, n)[n // 2 - wide : n // 2 + wide]
            steps.append(colour[:, edge : edge + wide].mean() - colour[:, edge - wide : edge].mean())
        assert steps[1] < 0.7 * steps[0], level
    tile = mended.report["refined"]["tiles"][5]
    assert tile["apart"][1] < 0.8 * tile["apart"][0] and tile["changed"] > 0


def test_what_changes_stays_within_its_bounds_and_what_reaches_a_border_keeps_its_bits(mended):
    before, after = tile_set().fields[0][5], mended.fields[0][5]
    shares = limits.compute_shares(labels(), FEW.reach, 8.0)
    bounds = limits.compute_bounds(before, shares, SIDE, FEW.colour, FEW.opacity, FEW.position * SPACING)
    for name, most, unit in (
        ("sh", bounds.colour[:, None, None], SH0),
        ("opacity_logits", bounds.opacity, 1.0),
        ("means", bounds.position[:, None], 1.0),
    ):
        moved = np.abs(getattr(after, name).astype(float) - getattr(before, name)) * unit
        assert (moved <= most + 1e-6).all(), name  # rounding of float32 around 1
        assert moved.max() > 0, name
    for name in ("log_scales", "quats", "uncertainty", "ground"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
    for now, was in zip(mended.fields, tile_set().fields, strict=True):
        for after, before in zip(now, was, strict=True):
            over = limits.border_clearance(before, SIDE) <= 0
            assert over.any() and same(after[over], before[over])
            np.testing.assert_array_equal(limits.border_clearance(after, SIDE) <= 0, over)


def test_a_prior_without_strength_changes_nothing_and_with_it_the_seed_decides_and_no_thread():
    def refined(*asked):
        few = replace(FEW, fit=2)
        return build._refine_tile(tile_set(), 0, UNCUT, few, repair.PriorRepair(prior, *asked), 64)[0]

    torch.manual_seed(0)
    prior, threads = TerrainPrior(Network()), torch.get_num_threads()
    assert same(refined(0.0), tile_set().fields[0][0])
    first = refined(0.3, 2, 1)
    assert not same(first, refined(0.3, 2, 2))
    try:
        torch.set_num_threads(3)
        assert same(first, refined(0.3, 2, 1))
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(threads)
