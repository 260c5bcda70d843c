"""Scatter: the instances shared with the page, no overlap, independence of the window; and a picture of it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import GRASS, SAND, SIDE, cover_content, two_classes
from fixtures.terrains import SKY
from scipy.spatial import cKDTree

from dav_gswt.bundle.build import BundleOptions, write_bundle
from dav_gswt.bundle.land_cover import ClassesEntry, ObjectEntry, ScatterEntry
from dav_gswt.files import parse_record
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.classes import Classes
from dav_gswt.terrain.scatter import Scatter

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "scatter.json").read_text())["terrains"]
WINDOW = 24  # tiles


def thing(radius, material=0, probability=0.5):
    return ObjectEntry("thing", radius, [0.0, 1.0], 0.0, material, 0.1, probability, [], [])


def window_of(scatter, west=0, south=0, size=WINDOW):
    i, j = (v.ravel() for v in np.mgrid[west : west + size, south : south + size].astype(np.int64))
    return scatter.instances_in(i, j)


def places_of(found, west=0, south=0):
    return np.stack([found.i - west + found.u, found.j - south + found.v], 1) * SIDE


@pytest.fixture(scope="module")
def plain():
    """Things of two sizes on one material."""
    return Scatter(ScatterEntry(4, 15.0, 0.15, 7), [thing(0.3, 0, 0.2), thing(0.6, 0, 0.1)], SIDE)


@pytest.fixture(scope="module")
def covered():
    classes = Classes(two_classes(), 2, SIDE)
    return Scatter(ScatterEntry(4, 15.0, 0.15, 7), [thing(0.5, 0, 0.3), thing(0.3, 1, 0.4)], SIDE, classes)


@pytest.mark.parametrize("terrain", GOLDEN, ids=range(len(GOLDEN)))
def test_instances_are_those_shared_with_the_page(terrain):
    classes = terrain["classes"] and Classes(
        parse_record(terrain["classes"], ClassesEntry), terrain["materials"], terrain["side"]
    )
    things = [thing(each["radius"], each["material"], each["probability"]) for each in terrain["objects"]]
    scatter = Scatter(ScatterEntry(**terrain["scatter"]), things, terrain["side"], classes)
    for cell in terrain["cells"]:
        found = scatter.instances_in(np.array([cell["i"]]), np.array([cell["j"]]))
        found = found[np.lexsort((found.u, found.v))]
        expected = cell["instances"]
        assert found.number.tolist() == [each["object"] for each in expected]
        for name in ("u", "v", "turn", "size"):
            np.testing.assert_allclose(getattr(found, name), [each[name] for each in expected], rtol=0, atol=1e-12)


def test_footprints_never_overlap(covered):
    found = window_of(covered)
    radius = np.array([each.radius for each in covered.objects])[found.number] * found.size
    places = places_of(found)
    pairs = cKDTree(places).query_pairs(2 * radius.max(), output_type="ndarray")
    gap = np.linalg.norm(places[pairs[:, 0]] - places[pairs[:, 1]], axis=1) - radius[pairs].sum(1)
    assert len(pairs) > 100 and gap.min() >= 0


@pytest.mark.parametrize("scatter", ["plain", "covered"])
@pytest.mark.parametrize("west", [-3, 1_000_000])
def test_a_cell_has_the_same_things_in_every_window(request, scatter, west):
    scatter = request.getfixturevalue(scatter)
    whole = window_of(replace(scatter), west, -5, 6)
    for i in range(west, west + 6):
        alone = replace(scatter).instances_in(np.array([i]), np.array([-3]))
        mine = whole[(whole.i == i) & (whole.j == -3)]
        assert sorted(alone.u.tolist()) == sorted(mine.u.tolist())


MAGENTA = [1.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def cover(tmp_path_factory):
    content = cover_content()
    info = write_bundle(content, tmp_path_factory.mktemp("cover") / "b", BundleOptions(tau=0.5, salt=7), {})
    fields = [content.tile_fields(level) for level in range(content.levels)]
    objects = [each.fields for each in content.objects]
    return replace(endless.terrain_from_fields(fields, info, {"kind": "flat"}, objects), reach=10)


@pytest.fixture(scope="module")
def bare(cover):
    """The same terrain without objects."""
    return replace(cover, scatter=None)


def test_a_picture_shows_both_materials_without_a_gap_and_the_objects(cover, bare):
    camera = stills.shot_camera(stills.Shot("down", (0.3, 0.2), 14.0, 90.0, 90.0), cover, 1.0, 64, 64)
    terrains = replace(bare, classes=None), bare, cover  # the first: its first material's tiles
    alone, image, full = (stills.render_view(terrain, camera, SKY, MAGENTA) for terrain in terrains)
    # magenta would raise blue above green
    assert (image[..., 2] - image[..., 1]).max() <= (alone[..., 2] - alone[..., 1]).max() + 0.02
    redder = image[..., 0] > image[..., 1]
    assert 0.2 < redder.mean() < 0.8
    assert image[redder].mean(0) == pytest.approx(SAND, abs=0.08)
    assert image[~redder].mean(0) == pytest.approx(GRASS, abs=0.08)
    changed = np.abs(image - full).max(-1) > 0.05
    assert 0.001 < changed.mean() < 0.3
    assert full[changed].mean(0) == pytest.approx([0.2, 0.35, 0.15], abs=0.1)
