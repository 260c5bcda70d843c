"""Fitted scatters: densities, losses included, and what does not fit."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import SIDE, cover_content, shrub

from dav_gswt.terrain import fit_scatter
from dav_gswt.terrain.classes import Classes
from dav_gswt.terrain.fit_cover import fit_cover
from dav_gswt.terrain.scatter import Scatter


@pytest.fixture(scope="module")
def fitted():
    things = [shrub(0.4, 0.1), replace(shrub(0.25, 0.06, 0), name="stone")]
    return fit_cover(replace(cover_content(), objects=things), 7)


def test_every_object_has_its_density_in_another_window(fitted):
    entries = fit_scatter._describe(fitted.objects, np.array(fitted.probabilities))
    scatter = Scatter(fitted.scatter, entries, SIDE, Classes(fitted.classes, 2, SIDE))
    i, j = (v.ravel() + 5000 for v in np.mgrid[:40, :40].astype(np.int64))
    counts = np.bincount(scatter.instances_in(i, j).number) / (40 * 40 * SIDE**2 * np.array([0.4, 0.6]))
    # the window has about 1000 and 900 things, and a share of ground of its own
    assert counts == pytest.approx([0.1, 0.06], rel=0.15)


def test_objects_may_stand_on_the_only_material():
    content = replace(cover_content(), classes=None)
    one = replace(content, tiles=content.tiles[:1], materials=[replace(content.materials[0], share=1.0)])
    made = fit_cover(replace(one, objects=[shrub(0.3, 0.2, 0)]), 7)
    assert made.classes is None and made.scatter is not None and 0 < made.probabilities[0] <= 1


def test_a_density_without_room_is_reported(caplog):
    content = replace(cover_content(), objects=[shrub(0.8, 2.0)])
    fit_scatter.fit_scatter(content, content.classes, 7)
    assert "there is no room for more" in caplog.text


def test_probabilities_of_one_material_sum_to_1_at_most():
    capped = fit_scatter._cap(np.array([0.9, 0.9, 0.5]), np.array([0, 0, 1]))
    assert capped == pytest.approx([0.5, 0.5, 0.5])
