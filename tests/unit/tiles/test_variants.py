"""The ways to cut a tile set, and exemplars that are hardly one."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.tiles import build, energy, layout
from dav_gswt.tiles.layout import CENTRE

CERTAIN = np.zeros((96, 96))
FEW = build.TilingOptions(share=0.5, strip=0.17, candidates=20, tries=1)


def cut(sample_ground, kind, colour=None, uncertainty=CERTAIN, options=FEW, levels=None):
    colour, rng = sample_ground.colour if colour is None else colour, np.random.default_rng(2)
    return build.cut_tiles(
        levels or sample_ground.levels, sample_ground.exemplar, colour, uncertainty, replace(options, kind=kind), rng
    )


@pytest.fixture(scope="module")
def every(sample_ground):
    return {kind: cut(sample_ground, kind) for kind in energy.KINDS}


def test_every_way_says_what_it_used(every):
    for kind, found in every.items():
        told = found.report.energy.to_dict()
        assert told["kind"] == kind and told["eps"] == energy.EPS
        assert ("semantics" in told["scales"]) == ("semantics" in told) == (kind != "colour")
        assert len(found.report.tile_energy) == len(found.report.tile_gamma) == 16
        assert told["standing"] == energy.OCCLUDER_WEIGHT
        gamma = {"colour": 1.0, "semantic-nogamma": 0.5}.get(kind, 0.7310585786)  # of no uncertainty: 1 / (1 + exp(-1))
        assert found.report.tile_gamma + found.report.strip_gamma == pytest.approx([gamma] * 20)


def test_a_straight_seam_costs_more_than_the_cheapest_one_between_the_same_patches(every):
    # the first strips were chosen before anything was cut
    for k in (0, 2):
        assert every["none"].report.strip_energy[k] > every["semantic"].report.strip_energy[k]
    assert every["none"].report.places.vertical == every["semantic"].report.places.vertical


def test_without_a_cut_seams_are_straight_and_in_the_middle_of_the_overlap(every):
    plan = layout.plan_layout(96, 3, 0.5, 0.17)
    depth = (plan.block + plan.strip) // 2
    for labels in every["none"].labels:
        inner = np.zeros_like(labels, bool)
        inner[depth:-depth, depth:-depth] = True
        np.testing.assert_array_equal(labels == CENTRE, inner)


def test_uncertain_ground_is_cut_by_semantics_more_than_by_colour(sample_ground):
    uncertain = cut(sample_ground, "semantic", uncertainty=np.full((96, 96), 0.75)).report
    assert uncertain.tile_gamma == pytest.approx([1 / (1 + np.exp(0.5))] * 16)
    steep = cut(sample_ground, "semantic", uncertainty=np.full((96, 96), 0.75), options=replace(FEW, slope=8.0)).report
    assert steep.tile_gamma == pytest.approx([1 / (1 + np.exp(2))] * 16)


@pytest.mark.parametrize("kind", energy.KINDS)
def test_patches_that_are_all_the_same_cost_nothing(sample_ground, kind):
    bare = [level[level.ground] for level in sample_ground.levels]
    found = cut(sample_ground, kind, colour=np.full((96, 96, 3), 0.5), levels=bare)
    # colours without their trend differ by rounding
    assert found.report.tile_energy + found.report.strip_energy == pytest.approx([0] * 20, abs=1e-9)
    assert np.isfinite(found.fields[0][0].means).all()


@pytest.mark.parametrize("kind", ["colour", "semantic"])
def test_tiles_go_around_holes_where_they_can(sample_ground, kind, caplog):
    colour = sample_ground.colour.copy()
    colour[30:44, 0:50] = np.nan
    options = replace(FEW, candidates=400)
    with caplog.at_level(logging.WARNING):
        found = cut(sample_ground, kind, colour=colour, options=options)
    assert "700 of 9216 cells of the exemplar are holes" in caplog.text
    # a patch may be up to 0.05 more uncertain than the surest one
    assert found.uncertainty.max() < 0.1
    assert all(np.isfinite(field.sh).all() for level in found.fields for field in level)


def test_unknown_uncertainty_counts_as_1(sample_ground):
    uncertainty = np.zeros((96, 96))
    uncertainty[:, :30] = np.nan
    assert (
        cut(sample_ground, "semantic", uncertainty=uncertainty, options=replace(FEW, candidates=400)).uncertainty.max()
        < 0.1
    )


@pytest.mark.parametrize(
    "colour, uncertainty",
    [
        pytest.param(np.full((96, 96, 3), np.nan), CERTAIN, id="holes only"),
        pytest.param(None, np.ones((96, 96)), id="all of it masked"),
        pytest.param(None, np.full((96, 96), np.nan), id="nothing known"),
    ],
)
def test_an_exemplar_without_any_known_ground_is_refused(sample_ground, colour, uncertainty):
    with pytest.raises(InputError, match="nothing is known of the exemplar.*masks"):
        cut(sample_ground, "semantic", colour=colour, uncertainty=uncertainty)


def test_uncertain_ground_that_cannot_be_avoided_is_logged(sample_ground, caplog):
    uncertainty = np.ones((96, 96))
    uncertainty[40:50, 40:50] = 0
    with caplog.at_level(logging.WARNING):
        cut(sample_ground, "semantic", uncertainty=uncertainty)
    assert "a smaller `tile`" in caplog.text


def test_a_finest_level_from_elsewhere_is_refused(sample_ground):
    levels = [replace(f, means=f.means + np.float32(1000)) for f in sample_ground.levels]
    with pytest.raises(InputError, match=r"level 0.*ground\.json"):
        build.cut_tiles(levels, sample_ground.exemplar, sample_ground.colour, CERTAIN, FEW, np.random.default_rng(0))


def test_options_are_those_of_the_configs_entry():
    seam = {"tile": 0.4, "strip": 0.1, "candidates": 7, "variants": 3, "energy": "colour", "slope": 4.0, "sam2": "a"}
    found = build.TilingOptions.from_config(seam, FEW.source)
    assert (found.share, found.strip, found.candidates, found.variants) == (0.4, 0.1, 7, 3)
    assert (found.kind, found.slope) == ("colour", 4.0)
    older = build.TilingOptions.from_config(
        {key: seam[key] for key in ("tile", "strip", "candidates", "variants")}, FEW.source
    )
    assert (older.kind, older.slope) == ("semantic", 2.0)


def test_an_energy_that_is_not_the_products_is_an_error():
    with pytest.raises(ValueError, match="'expansion' is no energy of seams: none, colour, semantic, semantic-nogamma"):
        build.TilingOptions.from_config({"energy": "expansion"}, FEW.source)
