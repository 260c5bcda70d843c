"""The ways to cut a tile set, and exemplars that are hardly one."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from dav_gswt.errors import InputError
from dav_gswt.tiles import layout
from dav_gswt.tiles.layout import CENTRE


@pytest.fixture(scope="module")
def every(cut):
    return {kind: cut(kind=kind) for kind in ("none", "semantic")}


def test_without_a_cut_seams_are_straight_and_in_the_middle_of_the_overlap_and_dearer(every):
    straight, cheapest = every["none"].report, every["semantic"].report
    for k in (0, 2):  # the first strips were chosen before anything was cut
        assert straight["strip_energy"][k] > cheapest["strip_energy"][k]
    assert straight["places"]["vertical"] == cheapest["places"]["vertical"]
    plan = layout.plan_layout(96, 3, 0.5, 0.17)
    depth = (plan.block + plan.strip) // 2
    for labels in every["none"].labels:
        inner = np.zeros_like(labels, bool)
        inner[depth:-depth, depth:-depth] = True
        np.testing.assert_array_equal(labels == CENTRE, inner)


def test_uncertain_ground_is_cut_by_semantics_more_than_by_colour(cut):
    report = cut(kind="semantic", slope=8.0, uncertainty=np.full((96, 96), 0.75)).report
    assert report["tile_gamma"] == pytest.approx([1 / (1 + np.exp(2))] * 16)


def test_tiles_go_around_holes_and_unknown_ground_where_they_can(cut, sample_ground, caplog):
    colour, uncertainty = sample_ground.colour.copy(), np.zeros((96, 96))
    colour[30:44, 0:50], uncertainty[:, :20] = np.nan, np.nan
    with caplog.at_level(logging.WARNING):
        found = cut(kind="colour", colour=colour, uncertainty=uncertainty, candidates=400)
    assert "700 of 9216 cells of the exemplar are holes" in caplog.text
    # a patch may be up to UNCERTAINTY_MARGIN more uncertain than the least uncertain one
    assert found.uncertainty.max() < 0.1
    assert all(np.isfinite(field.sh).all() for level in found.fields for field in level)


def test_variants_are_other_centres_in_the_same_frames(cut):
    two = cut(variants=2)
    assert len(two.labels) == 32 and two.variants == 2
    frame = two.labels[:, :4]
    np.testing.assert_array_equal(frame[:16], frame[16:])
    assert (two.shifts[:16, CENTRE] != two.shifts[16:, CENTRE]).any(1).all()


def test_an_exemplar_without_any_known_ground_is_refused(cut):
    holes = np.full((96, 96, 3), np.nan)
    for given in ({"colour": holes}, {"uncertainty": np.ones((96, 96))}, {"uncertainty": holes[..., 0]}):
        with pytest.raises(InputError, match="nothing is known of the exemplar.*masks"):
            cut(**given)


@pytest.mark.parametrize("level", [0, 1])
def test_a_level_from_elsewhere_is_refused(cut, sample_ground, level):
    levels = list(sample_ground.levels)
    levels[level] = replace(levels[level], means=levels[level].means + np.float32(1000))
    with pytest.raises(InputError, match=rf"level {level}.*ground\.json"):
        cut(levels=levels)
