"""Variation of the place: the numbers shared with the page, what it changes, and its fit to an exemplar."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures import tile_sets
from fixtures.land_covers import cover_content
from scipy.ndimage import gaussian_filter

from dav_gswt.bundle.build import BundleOptions, write_bundle
from dav_gswt.bundle.land_cover import WaveEntry
from dav_gswt.bundle.manifest import Manifest
from dav_gswt.errors import InputError
from dav_gswt.terrain import endless, placement, variation
from dav_gswt.terrain.finite import Area, list_cells, place_block
from dav_gswt.terrain.variation import Variation

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "heights.json").read_text())["variation"]
WAVES = [WaveEntry(0.63, [[0.2, 0.1, 0.1], [0.0, 0.3, 0.0]]), WaveEntry(1.57, [[0.1, 0.1, 0.0], [0.2, 0.0, 0.1]])]
AXIS = np.array([0.7, 0.6, 0.4]) / np.linalg.norm([0.7, 0.6, 0.4])


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Two materials with shrubs."""
    content = cover_content()
    info = write_bundle(content, tmp_path_factory.mktemp("plain") / "b", BundleOptions(tau=0.5, salt=7), {})
    fields = [content.tile_fields(level) for level in range(content.levels)]
    return endless.terrain_from_fields(fields, info, {"kind": "flat"}, [each.fields for each in content.objects])


@pytest.fixture(scope="module")
def varied(plain):
    return replace(plain, variation=Variation(WAVES, plain.side, plain.salt))


def test_numbers_are_those_shared_with_the_page():
    points, waves = GOLDEN["points"], [WaveEntry(**wave) for wave in GOLDEN["waves"]]
    x, y, material = (np.array([point[key] for point in points]) for key in ("x", "y", "material"))
    change = Variation(waves, GOLDEN["side"], GOLDEN["salt"]).at(x, y, material)
    np.testing.assert_allclose(change, [point["change"] for point in points], rtol=0, atol=1e-9)


def test_ground_has_the_colours_of_its_place_and_an_object_those_of_its_foot(plain, varied):
    cells = list_cells(plain, Area(-3, 2, 8, 8))
    before, after = (place_block(terrain, cells, 1, np.zeros(3))() for terrain in (plain, varied))
    things = plain.scatter.instances_in(cells.i, cells.j)
    each = len(plain.objects[0][1])
    ground = len(before) - each * len(things)
    x, y = before.means[:ground, :2].astype(float).T
    wanted = np.stack([varied.variation.at(x, y, m) for m in (0, 1)])
    sand = before.base_colours[:ground, 0] > before.base_colours[:ground, 1]
    assert 0.2 < sand.mean() < 0.9
    wanted = np.clip(before.base_colours[:ground] + np.where(sand[:, None], *wanted), 0, 1)
    np.testing.assert_allclose(after.base_colours[:ground], wanted, atol=2e-4)  # float32 places
    x, y = (things.i + things.u) * plain.side, (things.j + things.v) * plain.side
    at_feet = np.repeat(varied.variation.at(x, y, 1), each, axis=0)  # shrubs stand on grass
    wanted = np.clip(before.base_colours[ground:] + at_feet, 0, 1)
    np.testing.assert_allclose(after.base_colours[ground:], wanted, atol=1e-5)
    assert np.abs(at_feet).max() > 0.05


def cut_ground(wide, blob=0.0):
    """Tiles of an exemplar of grain and wide light and dark (standard deviation `wide`), and perhaps a bright blob."""
    sample, rng = tile_sets.exemplar(), np.random.default_rng(1)
    light = gaussian_filter(rng.normal(size=(tile_sets.CELLS, tile_sets.CELLS)), 12)
    light *= wide / light.std()
    y, x = np.mgrid[: tile_sets.CELLS, : tile_sets.CELLS]
    light += blob * (np.hypot(x - 30, y - 60) < 9)
    sample.colour = 0.4 + 0.05 * rng.normal(size=(*light.shape, 1)) * AXIS + light[..., None] * AXIS
    c, h = sample.colour, sample.height
    for number in range(tile_sets.LEVELS):
        sample.levels[number] = tile_sets.level(c, h, tile_sets.SPACING * 2**number)
        c, h = tile_sets.halved(c), tile_sets.halved(h)
    return tile_sets.tiles_of(sample)


def measure_spread(waves):
    """Standard deviation of a variation along AXIS, in a large square."""
    x, y = np.random.default_rng(0).uniform(-500, 500, (2, 20000))
    return float((Variation(waves or [], 1.0, 3).at(x, y, 0) @ AXIS).std())


def test_large_scale_light_comes_back_along_its_own_axis():
    waves = variation.fit_variation([cut_ground(0.04)], 1.0, 0)
    for wave in waves:
        assert np.array(wave.colours[0]) @ AXIS == pytest.approx(np.linalg.norm(wave.colours[0]), rel=1e-2)
    # all but the part of the light that is as narrow as texture was taken out with the trend
    assert 0.02 < measure_spread(waves) < 0.05
    doubled = variation.fit_variation([cut_ground(0.04)], 2.0, 0)
    assert measure_spread(doubled) == pytest.approx(2 * measure_spread(waves), rel=1e-3)


def test_even_ground_and_a_single_blob_are_no_variation():
    even, blob = (measure_spread(variation.fit_variation([cut_ground(0.0, b)], 1.0, 0)) for b in (0.0, 0.5))
    assert even < 0.006
    assert blob < 0.02  # a disc so bright alone has a deviation of .08


def test_nothing_is_added_where_it_is_turned_off_or_tiles_are_known_by_their_gaussians_alone(plain):
    assert variation.fit_variation([cut_ground(0.04)], 0.0, 0) is None
    assert variation.fit_variation(cover_content().tiles, 1.0, 0) is None
    cells = list_cells(plain, Area(0, 0, 1, 1))
    tile = placement.collect_tiles(replace(plain, classes=None), cells, [0])[0]
    assert tile is plain.tiles[0, int(cells.tile[0])]


@pytest.mark.parametrize("waves", [[], [WaveEntry(0.63, [[0.1] * 3])]])
def test_manifests_whose_waves_do_not_fit_are_refused(tmp_path, waves):
    content = replace(cover_content(), variation=WAVES)
    value = write_bundle(content, tmp_path / "b", BundleOptions(tau=0.5), {}).to_dict()
    assert Manifest.from_dict(value).variation == WAVES
    with pytest.raises(InputError, match="variation"):
        Manifest.from_dict(value | {"variation": [vars(wave) for wave in waves]})
