"""Tiles refined by repairs that are known: what changes, by how much, and what must not."""

from dataclasses import fields as members
from dataclasses import replace

import numpy as np
import pytest
import torch
from fixtures.tile_sets import report_of

from dav_gswt.field import SH0, GaussianField, concatenate_fields
from dav_gswt.prior.interface import Condition, DecodedViews
from dav_gswt.prior.networks import Network
from dav_gswt.prior.terrain import TerrainPrior
from dav_gswt.study.refine import build, limits, repair
from dav_gswt.study.refine.build import Options, UncutGround
from dav_gswt.tiles.build import TileSet
from dav_gswt.tiles.layout import CENTRE, EDGES, Exemplar, W

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


def brightness(step, n=N):
    inside = (labels() == CENTRE).reshape(n, N // n, n, N // n).mean((1, 3))
    grain = 0.01 * np.sin(np.arange(n * n)).reshape(n, n, 1)
    return 0.4 + grain + step * inside[..., None] * np.ones(3)


def tile_set(step=STEP):
    finest, coarse = (ground(n, SIDE / n, brightness(step, n)) for n in (N, N // 2))
    shifts = np.zeros((EDGES, 9, 2), int)
    levels = [[finest] * EDGES, [coarse] * EDGES]
    return TileSet(SIDE, SPACING, levels, np.stack([labels()] * EDGES), shifts, np.zeros(EDGES), report_of(N, 8))


UNCUT = UncutGround(ground(48, SPACING, np.full((48, 48, 3), 0.4), -3.0, -3.0), Exemplar(-3.0, -3.0, SPACING, 48))


def nothing(condition, near):
    return np.zeros_like(condition.colour)


def truth(condition, near):
    """The ground without the step: as bright everywhere as outside."""
    return np.where(condition.colour > 0.44, np.float32(-STEP), np.float32(0)) * np.ones(3, np.float32)


def refine(by, options=FEW, step=STEP):
    return build.refine_tiles(tile_set(step), UNCUT, options, by, 32)


@pytest.fixture(scope="module")
def mended():
    return refine(truth)


def same(one: GaussianField, two: GaussianField) -> bool:
    return all(getattr(one, f.name).tobytes() == getattr(two, f.name).tobytes() for f in members(GaussianField))


def test_where_nothing_is_repaired_every_level_keeps_its_bytes():
    found, before = refine(nothing), tile_set()
    for one, two in zip(found.fields, before.fields, strict=True):
        assert all(same(a, b) for a, b in zip(one, two, strict=True))
    assert all(tile["changed"] == 0 for tile in found.report.more["refined"]["tiles"])


def step_at_the_cut(field, n):
    """Between the means of two finest cells on both sides of the western cut."""
    colour, edge, wide = field.base_colours[:, 0].reshape(n, n), EDGE * n // N, 2 * n // N
    along = slice(n // 2 - wide, n // 2 + wide)
    return colour[along, edge : edge + wide].mean() - colour[along, edge - wide : edge].mean()


def test_a_step_of_brightness_becomes_smaller_in_every_level(mended):
    for level, n in ((0, N), (1, N // 2)):
        before, after = (step_at_the_cut(tiles.fields[level][5], n) for tiles in (tile_set(), mended))
        assert after < 0.7 * before, level
    tile = mended.report.more["refined"]["tiles"][5]
    assert tile["apart"][1] < 0.8 * tile["apart"][0] and tile["changed"] > 0


def test_what_changes_stays_within_its_bounds(mended):
    before = tile_set().fields[0][5]
    bounds = limits.compute_bounds(
        before, limits.compute_shares(labels(), FEW.reach, 8.0), SIDE, FEW.colour, FEW.opacity, FEW.position * SPACING
    )
    after = mended.fields[0][5]
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


def test_what_reaches_a_border_keeps_its_bits_so_that_neighbours_still_continue(mended):
    for now, was in zip(mended.fields, tile_set().fields, strict=True):
        for after, before in zip(now, was, strict=True):
            over = limits.border_clearance(before, SIDE) <= 0
            assert over.any() and same(after[over], before[over])
            np.testing.assert_array_equal(limits.border_clearance(after, SIDE) <= 0, over)


def test_two_rounds_stay_within_the_bounds_of_one():
    found = refine(truth, replace(FEW, rounds=2))
    moved = np.abs(found.fields[0][5].sh.astype(float) - tile_set().fields[0][5].sh) * SH0
    assert 0 < moved.max() <= FEW.colour + 1e-6


def test_labels_and_what_was_cut_are_kept(mended):
    before = tile_set()
    np.testing.assert_array_equal(mended.labels, before.labels)
    assert (mended.side, mended.spacing) == (before.side, before.spacing)
    assert mended.report.layout == before.report.layout
    assert mended.report.more["refined"]["options"]["reach"] == FEW.reach


def test_a_tile_without_a_cut_is_left_alone():
    plain = replace(tile_set(), labels=np.full((EDGES, N, N), CENTRE, np.uint8))
    found = build.refine_tiles(plain, UNCUT, FEW, truth, 32)
    assert all(same(a, b) for a, b in zip(found.fields[0], plain.fields[0], strict=True))


@pytest.fixture(scope="module")
def prior():
    torch.manual_seed(0)
    return TerrainPrior(Network())


def one_tile(by):
    return build._refine_tile(tile_set(), 0, UNCUT, replace(FEW, fit=2), by, 64)[0]


def test_a_prior_without_strength_changes_nothing_and_with_it_the_seed_decides(prior):
    assert same(one_tile(repair.PriorRepair(prior, 0.0)), tile_set().fields[0][0])
    first, again, other = (one_tile(repair.PriorRepair(prior, 0.3, 2, seed)) for seed in (1, 1, 2))
    assert same(first, again) and not same(first, other)


def test_threads_of_the_networks_change_no_byte(prior):
    threads, found = torch.get_num_threads(), []
    try:
        for count in (1, 3):
            torch.set_num_threads(count)
            found.append(one_tile(repair.PriorRepair(prior, 0.3, 2)))
            assert torch.get_num_threads() == count
    finally:
        torch.set_num_threads(threads)
    assert same(*found)


def test_the_terrain_prior_can_repair(prior):
    assert isinstance(prior, repair.Repairer)


class RecordingPrior:
    """Records its arguments."""

    name, size = "recording", 32

    def repair(self, condition, strength, steps, seed, known=None):
        self.recorded = (strength, steps, seed, known)
        return self.encode_render(condition)

    def sample(self, condition, m, p_drop, steps, seed, common=True):
        raise AssertionError("a repair asks for no samples")

    def estimate_variances(self, latents):
        raise AssertionError("nor for variances")

    def encode_render(self, condition):
        return condition.colour.transpose(0, 3, 1, 2)

    def decode(self, latents):
        colour = np.ascontiguousarray(latents.transpose(0, 2, 3, 1))
        return DecodedViews(np.concatenate([colour, np.ones_like(colour[..., :1])], -1), None)


def test_the_prior_is_told_not_to_believe_the_render_beside_the_cut():
    grey = np.full((1, 32, 32, 3), 0.5, np.float32)
    one = np.ones((1, 32, 32), np.float32)
    condition = Condition(grey, one, one, grey, np.float32([[0, 0, 1, 0]]))
    near = np.zeros((1, 32, 32), np.float32)
    near[0, 9, 14] = 0.9
    model = RecordingPrior()
    assert not repair.PriorRepair.from_config(model, {"prior": "x", "strength": 0.2, "steps": 3}, 7)(
        condition, near
    ).any()
    strength, steps, seed, known = model.recorded
    assert (strength, steps, seed) == (0.2, 3, 7)
    np.testing.assert_array_equal(np.argwhere(~known[0]), [[2, 3]])
    repair.PriorRepair.from_config(model, {"strength": 0.2, "condition": True}, 7)(condition, near)
    assert model.recorded[3] is None


def test_neighbours_are_what_a_tile_is_seen_among(monkeypatch):
    """Another colour of the neighbours changes what the tile's pictures show."""
    seen = []

    def look(condition, near):
        seen.append(condition.colour)
        return np.zeros_like(condition.colour)

    tiles = tile_set()
    build._refine_tile(tiles, 0, UNCUT, FEW, look, 32)
    bright = replace(tiles.fields[0][0], sh=tiles.fields[0][0].sh + 1)
    monkeypatch.setattr(build.viewpoints, "assemble_neighbours", lambda *_: concatenate_fields([bright]))
    build._refine_tile(tiles, 0, UNCUT, FEW, look, 32)
    assert np.abs(seen[0] - seen[1]).max() > 0.05
