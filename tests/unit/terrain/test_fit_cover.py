"""Fitted cover: shares and patch scales of classes, biases and the transition; densities of scattered objects."""

from dataclasses import replace

import numpy as np
import pytest
from fixtures.land_covers import SIDE, cover_content, shrub

from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.land_cover import ObjectEntry
from dav_gswt.materials.borders import measure_strays
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


def test_stretches_have_the_wanted_length_in_the_mean(fitted):
    content, classes = fitted
    stretches, _ = fits.measure_lines(classes, 8)
    ratio = np.log(stretches * SIDE / [m.patch_scale for m in content.materials])
    assert abs(ratio @ [m.share for m in content.materials]) < 0.1


def measure_terrain(entry, cells=80, tiles=5):
    """How far borders of two materials stray at `borders.WIDTHS`, jitter included, in tile sides."""
    classes, found = Classes(entry, 2, SIDE), []
    u, v = (w.ravel() for w in np.meshgrid(*[(np.arange(cells) + 0.5) / cells] * 2))
    for first in range(0, 1800, 300):
        own = np.block([
            [classes.frayed_scores(first + i, j, u, v).argmax(1).reshape(cells, cells) for i in range(tiles)]
            for j in range(tiles)
        ])  # fmt: skip
        found.append(measure_strays(own.astype(float), np.ones(own.shape, bool), float(cells)))
    return np.mean([each for each in found if each], 0) / cells


@pytest.mark.parametrize("strays", [[0.026, 0.014, 0.008], [0.016, 0.008, 0.004]], ids=["rough", "even"])
def test_borders_stray_as_photographed_ones_do_at_every_width(strays):
    content = content_of((0.6, 12.0), (0.4, 12.0), strays=[stray * SIDE for stray in strays])
    found = measure_terrain(fits.fit_classes(content, 7))
    assert np.log(found[:3] / strays) == pytest.approx(np.zeros(3), abs=0.35)


def test_the_relief_of_the_ground_itself_does_not_count_as_height():
    content = content_of((0.5, 10.0), (0.5, 10.0))
    rng = np.random.default_rng(1)
    fields = [
        [replace(f, means=f.means + np.float32([0, 0, 1]) * rng.normal(0.3, 0.05, (len(f), 1)).astype(np.float32))
         for f in level] for level in content.tiles[0].fields
    ]  # fmt: skip
    content = replace(content, tiles=[replace(content.tiles[0], fields=fields), content.tiles[1]])
    rise = fits.fit_classes(content, 0).rise
    assert rise.ground == pytest.approx([0.3, 0.0], abs=0.01)
    assert rise.clearance == pytest.approx([0.1, 0.0], abs=0.01)


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
