"""Light of the place: the numbers shared with the page, and what a sun does to hills, shadows and the sky."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import cover_content

from dav_gswt.bundle.build import BundleOptions, write_bundle
from dav_gswt.bundle.land_cover import LightEntry
from dav_gswt.bundle.manifest import Sky
from dav_gswt.terrain import endless, stills
from dav_gswt.terrain.heights import FlatSurface, HeightMap, Hills, Sphere
from dav_gswt.terrain.light import Light, Sun, apply_light, find_hour, light_of, place_light, relight, sun_at

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "light.json").read_text())
NOON = Sun(60.0, 180.0)


def test_numbers_are_those_shared_with_the_page():
    for case in GOLDEN["lights"]:
        captured, sky = Sun(*case["captured"]), Sky(case["zenith"], case["horizon"])
        sun = sun_at(captured, case["hour"], case["north"])
        light = Light(captured, sun)
        changed = light.change_sky(sky)
        for name, value in {
            "captured_hour": find_hour(captured, case["north"]),
            "sun": [sun.elevation, sun.azimuth],
            "direct": light.terms[0],
            "ambient": light.terms[1],
            "ratios": light.ratio(np.array(case["slopes"]), np.array(case["visible"])),
            "new_zenith": changed.zenith,
            "new_horizon": changed.horizon,
            "sun_colour": light.sun_colour,
            "shown": light.add_sun(np.array(case["colours"]), np.array(case["rays"])),
        }.items():
            np.testing.assert_allclose(value, case[name], rtol=0, atol=1e-9, err_msg=name)
    shade = GOLDEN["shadows"]
    placed = place_light(
        Light(NOON, Sun(*shade["sun"])), Hills(**shade["hills"]), shade["side"], np.array(shade["eye"])
    )
    x, y = np.array(shade["points"]).T
    np.testing.assert_allclose(placed.visible(x, y), shade["visible"], rtol=0, atol=1e-6)
    assert 0.2 < np.mean(shade["visible"]) < 0.8


@pytest.mark.parametrize("hour, known", [(7.0, False), (float("nan"), True), (float("inf"), True)])
def test_an_hour_needs_a_sun_and_must_be_finite(covered, hour, known):
    manifest = replace(covered[0], light=LightEntry(30.0, 100.0, "exif") if known else None)
    with pytest.raises(ValueError, match="hour: "):
        light_of(manifest, hour)


def test_open_level_ground_keeps_its_colours_below_the_captured_sun():
    light = Light(NOON, NOON)
    np.testing.assert_allclose(light.ground_ratio, 1, atol=1e-12)
    colours = np.random.default_rng(0).random((50, 3))
    np.testing.assert_allclose(relight(colours, np.broadcast_to(light.ground_ratio, (50, 3))), colours, atol=1e-12)
    assert light.change_sky(Sky()) == Sky()


def test_the_day_goes_through_the_captured_sun():
    for captured in (
        Sun(45.0, 225.0),
        Sun(3.0, 91.0),
        Sun(89.9, 10.0),
        Sun(30.0, 355.0),
        Sun(20.0, 180.0),
        Sun(3.0, 270.0),
        Sun(90.0, 0.0),
    ):
        again = sun_at(captured, find_hour(captured))
        np.testing.assert_allclose(again.direction, captured.direction, atol=1e-9)
        for hour in (-3.0, 6.0, 12.0, 18.0, 99.0):
            assert 2.999 <= sun_at(captured, hour).elevation <= 90.001
    assert sun_at(NOON, 8.0).azimuth < 180 < sun_at(NOON, 16.0).azimuth


def test_a_wall_casts_a_shadow_of_the_length_that_its_height_says():
    pixels = np.zeros((256, 256), np.float32)
    pixels[:, 126:130] = 2.0  # a wall from north to south, 4 wide, at x = 0
    surface = HeightMap(pixels, 256.0)
    placed = place_light(Light(NOON, Sun(30.0, 90.0)), surface, 1.0, np.zeros(3))
    x = np.arange(-20, 20, 0.1)
    seen = placed.visible(x, np.zeros(len(x)))
    shade = x[seen < 0.5]
    assert shade.max() == pytest.approx(-2, abs=1)  # west of the wall
    assert shade.min() == pytest.approx(-1 - 2 / np.tan(np.radians(30)), abs=0.8)
    assert (seen[x > 2.5] > 0.99).all()


@pytest.fixture(scope="module")
def covered(tmp_path_factory):
    content = cover_content()
    info = write_bundle(content, tmp_path_factory.mktemp("lit") / "b", BundleOptions(tau=0.5, salt=7), {})
    fields = [content.tile_fields(level) for level in range(content.levels)]
    objects = [each.fields for each in content.objects]
    return info, endless.terrain_from_fields(fields, info, {"kind": "hills", "height": 3.0, "wavelength": 8.0}, objects)


def test_stills_are_lit_where_the_manifest_has_a_sun(covered):
    info, terrain = covered
    shot = stills.SHOTS[1]
    plain = stills.render_shot(terrain, shot, info, 96, 64)
    captured = replace(info, light=LightEntry(40.0, 200.0, "config"))
    lit = stills.render_shot(terrain, shot, captured, 96, 64)
    assert 0.01 < np.abs(lit - plain).mean() < 0.2
    camera = stills.shot_camera(shot, terrain, info.eye_floor, 96, 64)
    evening = stills.render_view(terrain, camera, info.sky, info.ground_colour, light=light_of(captured, 17.9))
    assert evening.mean() < 0.9 * lit.mean()
    flat = replace(terrain, heights=FlatSurface())
    np.testing.assert_allclose(
        stills.render_view(flat, camera, info.sky, info.ground_colour, light=light_of(captured))[40:],
        stills.render_view(flat, camera, info.sky, info.ground_colour)[40:],
        atol=1e-5,
    )


def test_a_page_takes_its_sun_from_the_config_or_the_photos(covered):
    info, terrain = covered
    by_photos = replace(info, light=LightEntry(30.0, 100.0, "exif"))
    surface = terrain.heights
    assert apply_light(info, "auto", 1.0, surface).light == LightEntry(45.0, 225.0, "assumed")
    turned = replace(info, light=LightEntry(30.0, 100.0, "exif", 33.0))
    south = apply_light(turned, {"elevation": 45.0, "azimuth": 180.0}, 0.0, surface)
    assert south.light == LightEntry(45.0, 147.0, "config", 33.0)
    assert find_hour(Sun(45.0, 147.0), 33.0) == pytest.approx(12)
    np.testing.assert_allclose(light_of(south, 12.0).sun.direction, Sun(45.0, 147.0).direction, atol=1e-12)
    assert apply_light(by_photos, "auto", 1.0, surface).light == by_photos.light
    assert apply_light(by_photos, {"elevation": 12.0, "azimuth": 3.0}, 0.0, surface).light == LightEntry(
        12.0, 3.0, "config"
    )
    none = apply_light(by_photos, "none", 0.0, surface)
    assert none.light is None and none.wind is None
    planet = apply_light(by_photos, "auto", 1.0, Sphere(9.0, 1.0, 13))
    assert planet.light is None and planet.wind is None
    assert type(info).from_dict(apply_light(by_photos, "auto", 2.0, surface).to_dict()).wind == 2
