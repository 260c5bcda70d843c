"""Fitted cover: shares of classes, and densities of scattered objects."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import SIDE, cover_content, shrub

from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.land_cover import ObjectEntry
from dav_gswt.materials.model import MaterialInfo
from dav_gswt.terrain import fit_cover as fits
from dav_gswt.terrain.classes import Classes
from dav_gswt.terrain.fit_cover import fit_cover
from dav_gswt.terrain.scatter import Scatter


def content_of(*materials, strays=None):
    tiles = [replace(each, spacing=SIDE / 200) for each in cover_content().tiles]  # jitter of every octave is drawn
    named = [MaterialInfo(str(k), share, scale, [0.5] * 3, strays) for k, (share, scale) in enumerate(materials)]
    return BundleContent([tiles[k % 2] for k in range(len(named))], named)


@pytest.fixture(scope="module", params=[((0.6, 12.0), (0.4, 8.0)), ((0.5, 14.0), (0.3, 14.0), (0.2, 10.0))], ids=len)
def fitted(request):
    content = content_of(*request.param)
    return content, Classes(fits.fit_classes(content, 7), len(content.materials), SIDE)


def test_every_material_has_its_share_of_ground_that_was_not_fitted(fitted):
    content, classes = fitted
    points = np.random.default_rng(99).integers(-(2**30), 2**30, (2, 100_000))
    reached = np.bincount(classes.lattice_scores(*points).argmax(1)) / 100_000
    # 40 000 or more samples of the fit and these: 0.25 % each
    assert reached == pytest.approx([m.share for m in content.materials], abs=0.01)


def test_every_object_has_its_density_in_another_window():
    things = [shrub(0.4, 0.1), replace(shrub(0.25, 0.06, 0), name="stone")]
    fitted = fit_cover(replace(cover_content(), objects=things), 7)
    entries = [
        ObjectEntry(each.name, each.radius, [0.0, 0.0], 0.0, each.material, each.density, p, [], [])
        for each, p in zip(fitted.objects, fitted.probabilities, strict=True)
    ]
    scatter = Scatter(fitted.scatter, entries, SIDE, Classes(fitted.classes, 2, SIDE))
    i, j = (v.ravel() + 5000 for v in np.mgrid[:40, :40].astype(np.int64))
    counts = np.bincount(scatter.instances_in(i, j).number) / (40 * 40 * SIDE**2 * np.array([0.4, 0.6]))
    # the window has about 1000 and 900 things, and a share of ground of its own
    assert counts == pytest.approx([0.1, 0.06], rel=0.15)
