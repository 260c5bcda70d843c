"""Fitted cover: shares and patch scales of classes, biases and the transition; densities of scattered objects."""

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


def content_of(*materials, fray=None, bend=None):
    tiles = cover_content().tiles
    named = [MaterialInfo(str(k), share, scale, [0.5] * 3, fray, bend) for k, (share, scale) in enumerate(materials)]
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


def measure_movement(classes):
    """How far jitter moves a border in the mean, in tile sides."""
    u, v = np.random.default_rng(0).random((2, 5000))
    jitter = classes.jitter_at(3, 4, u, v)
    _, steepness = fits.measure_lines(classes, 8)
    return np.abs(jitter[:, 0] - jitter[:, 1]).mean() / steepness


@pytest.mark.parametrize("fray", [None, 0.12])
def test_jitter_moves_a_border_as_far_as_photographed_ones_stray(fray):
    content = content_of((0.6, 12.0), (0.4, 12.0), fray=fray and fray * SIDE)
    moved = measure_movement(Classes(fits.fit_classes(content, 7), 2, SIDE))
    assert moved == pytest.approx(fray or fits.FRAY, rel=0.2)


def test_borders_bend_as_photographed_ones_do(monkeypatch):
    for name, few in (("SAMPLES", 5000), ("LINES", 8), ("PASSES", 1), ("WINDOWS", 2), ("WINDOW", 6)):
        monkeypatch.setattr(fits, name, few)
    found = []
    for bend in (0.0, 1.0):
        content = content_of((0.6, 24.0), (0.4, 24.0), bend=bend * SIDE)
        entry = fits.fit_classes(content, 7)
        found.append((max(entry.rule[0].octaves), fits.measure_bends(Classes(entry, 2, SIDE), 7)))
    assert found[0][0] == 1 < found[1][0] and found[0][1] < found[1][1]


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
