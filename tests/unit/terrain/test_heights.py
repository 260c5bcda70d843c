"""Height fields: hand-worked values, bounds, derivatives against differences, the numbers shared with the page."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import tifffile
from hypothesis import given
from hypothesis import strategies as st

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain import heights
from dav_gswt.terrain.choice import hash_cell
from dav_gswt.terrain.heights import STEEPEST, FlatSurface, HeightField, HeightMap, Hills

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "heights.json").read_text())["surfaces"]
RNG = np.random.default_rng(0)
RUGGED = HeightMap(RNG.normal(size=(7, 9)).astype(np.float32), 13.0)
SURFACES = [
    pytest.param(Hills(2.0, 7.0, 5, 3), id="hills"),
    pytest.param(RUGGED, id="mirrored image"),
    pytest.param(HeightMap(RUGGED.pixels, 13.0, "clamp"), id="clamped image"),
]
salts = st.integers(0, 2**32 - 1)


def surface_of(entry) -> HeightField:
    if entry["kind"] == "hills":
        return Hills(*(entry[key] for key in ("height", "wavelength", "octaves", "salt")))
    return HeightMap(np.array(entry["pixels"], np.float32), entry["width"], entry["beyond"])


def places(n, reach=60.0):
    return RNG.uniform(-reach, reach, (2, n))


@pytest.mark.parametrize("entry", GOLDEN, ids=lambda e: e["kind"])
def test_numbers_are_those_shared_with_the_page(entry):
    surface = surface_of(entry)
    points = entry["points"]
    height, slope = surface.at(*(np.array([p[key] for p in points]) for key in "xy"))
    # the order of sums may differ between languages; nothing here is larger than about 10
    np.testing.assert_allclose(height, [p["height"] for p in points], rtol=0, atol=1e-9)
    np.testing.assert_allclose(slope, [p["slope"] for p in points], rtol=0, atol=1e-9)
    bounds = [surface.low, surface.high, surface.steepest]
    np.testing.assert_allclose(bounds, [entry[key] for key in ("low", "high", "steepest")], rtol=1e-12)


def test_a_plain_is_level():
    height, slope = FlatSurface().at(*places(5))
    assert not height.any() and not slope.any()
    assert (FlatSurface.low, FlatSurface.high, FlatSurface.steepest) == (0, 0, 0)


def test_hills_half_way_along_an_edge_are_worked_by_hand():
    # on an edge of the lattice only its two corners count; half-way each has weight 1/2 and is half a cell away
    west, east = (hash_cell(i, 0, heights.HILLS, 5) & 0xFFFF for i in (0, 1))
    g0, g1 = west / 32767.5 - 1, east / 32767.5 - 1
    height, _ = Hills(3.0, 10.0, 1, 5).at(np.array([5.0]), np.array([0.0]))
    assert height[0] == pytest.approx(3 * (0.5 * g0 * 0.5 + 0.5 * g1 * -0.5), abs=1e-15)


def test_at_the_lattice_one_octave_is_zero_and_as_steep_as_its_hash_says():
    bits = hash_cell(-4, 9, heights.HILLS, 1)
    height, slope = Hills(1.0, 2.0, 1, 1).at(np.array([-8.0]), np.array([18.0]))
    assert height[0] == 0
    expected = 0.5 * np.array([(bits & 0xFFFF) / 32767.5 - 1, (bits >> 16) / 32767.5 - 1])
    np.testing.assert_allclose(slope[0], expected, rtol=1e-15)


def test_octaves_are_not_all_zero_at_the_same_places():
    i, j = np.meshgrid(np.arange(8.0), np.arange(8.0))
    height, _ = Hills(1.0, 1.0, 4, 2).at(i.ravel(), j.ravel())
    assert (np.abs(height) > 1e-3).mean() > 0.9


@given(salts, st.floats(0.1, 50.0), st.integers(1, 8))
def test_hills_stay_within_their_bounds(salt, wavelength, octaves):
    surface = Hills(2.0, wavelength, octaves, salt)
    height, slope = surface.at(*places(200))
    assert (np.abs(height) <= 2.0).all()
    assert (np.hypot(*slope.T) <= surface.steepest).all()


def test_no_gradients_at_the_corners_make_the_noise_steeper_than_its_bound(monkeypatch):
    """The slope is linear in the corners' gradients: along an angle its largest is the sum of what each can add."""
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0.005, 0.995, 100), np.linspace(0.005, 0.995, 100)))
    turns = np.stack([[np.cos(a), np.sin(a)] for a in np.linspace(0, np.pi, 61)])
    most = np.zeros((len(turns), len(u)))
    for corner in range(4):
        for bits in (0xFFFF | 0x7FFF0000, 0x7FFF | 0xFFFF0000):  # gradients (1, ~0) and (~0, 1)

            def one(i, j, axis, salt, corner=corner, bits=bits):
                mine = (i == corner % 2) & (j == corner // 2)
                return np.where(mine, bits, 0x7FFF7FFF)

            monkeypatch.setattr(heights, "hash_cell", one)
            most += np.abs(turns @ heights.gradient_noise(u, v, 3, 0)[1].T)
    # 0x7fff is -1.5e-5 and not 0, in up to 8 terms
    assert most.max() < STEEPEST + 1e-3
    assert most.max() > 0.98 * STEEPEST  # and the bound is hardly larger than it must be


@pytest.mark.parametrize("surface", SURFACES)
def test_slopes_are_those_of_differences(surface):
    x, y = places(400)
    eps = 1e-5
    _, slope = surface.at(x, y)
    east = (surface.at(x + eps, y)[0] - surface.at(x - eps, y)[0]) / (2 * eps)
    north = (surface.at(x, y + eps)[0] - surface.at(x, y - eps)[0]) / (2 * eps)
    # error eps times the second derivative, at most about 30, where a spline's pieces meet; and 1e-16 / eps of rounding
    np.testing.assert_allclose(slope, np.stack([east, north], 1), rtol=0, atol=30 * eps)


@pytest.mark.parametrize("surface", SURFACES)
def test_height_and_slope_have_no_jumps(surface):
    """Over cell borders, pixel borders and the edge of an image."""
    t = np.linspace(-20, 20, 200_001)
    height, slope = surface.at(t, 0.3 * t + 0.1)
    assert np.abs(np.diff(height)).max() <= surface.steepest * 2e-4 * 1.05
    assert np.abs(np.diff(slope, axis=0)).max() < 100 * 2e-4  # second derivatives are below 100


@pytest.mark.parametrize("surface", SURFACES)
def test_bounds_hold(surface):
    assert isinstance(surface, HeightField)
    height, slope = surface.at(*places(5000))
    assert surface.low <= height.min() and height.max() <= surface.high
    assert np.hypot(*slope.T).max() <= surface.steepest


def test_a_constant_image_is_a_plateau():
    height, slope = HeightMap(np.full((3, 5), 1.25, np.float32), 10.0).at(*places(50))
    np.testing.assert_allclose(height, 1.25, rtol=1e-15)
    np.testing.assert_allclose(slope, 0, atol=1e-15)


def test_a_ramp_in_the_middle_of_an_image_has_its_slope():
    """10 pixels over 20 units, each 1 higher than its western neighbour: a B-spline of a line is that line."""
    ramp = HeightMap(np.tile(np.arange(10, dtype=np.float32), (10, 1)), 20.0)
    height, slope = ramp.at(np.array([-3.0, 0.0, 4.4]), np.array([1.0, 0.0, -2.0]))
    np.testing.assert_allclose(height, [4.5 - 1.5, 4.5, 4.5 + 2.2], atol=1e-12)
    np.testing.assert_allclose(slope, [[0.5, 0]] * 3, atol=1e-12)


def test_the_first_row_of_an_image_lies_in_the_north():
    north = HeightMap(np.array([[1.0], [0.0]], np.float32), 1.0)
    assert north.at(np.array([0.0, 0.0]), np.array([0.5, -0.5]))[0].tolist() == [0.875, 0.125]


def test_a_mirrored_image_is_the_same_on_both_sides_of_its_edge():
    x, y = places(100, 6.0)
    edge, top = 6.5, 6.5 * 7 / 9
    np.testing.assert_allclose(RUGGED.at(edge + x, y)[0], RUGGED.at(edge - x, y)[0], atol=1e-9)
    np.testing.assert_allclose(RUGGED.at(x, top + y)[0], RUGGED.at(x, top - y)[0], atol=1e-9)
    np.testing.assert_allclose(RUGGED.at(x + 26, y)[0], RUGGED.at(x, y)[0], atol=1e-9)


def test_a_clamped_image_goes_on_as_its_edge():
    clamped = HeightMap(RUGGED.pixels, 13.0, "clamp")
    far, _ = clamped.at(np.array([50.0, 1e6]), np.array([1.0, 1.0]))
    assert far[0] == pytest.approx(far[1], rel=1e-14)
    _, slope = clamped.at(np.array([50.0]), np.array([500.0]))
    np.testing.assert_allclose(slope, 0, atol=1e-12)
    assert clamped.at(np.array([50.0]), np.array([500.0]))[0][0] == pytest.approx(float(RUGGED.pixels[0, -1]))


@pytest.mark.parametrize("suffix", ["exr", "png"])
def test_an_image_file_becomes_a_surface(tmp_path, suffix):
    """EXR keeps floats as they are, beyond 1 and below 0 too; PNG is 0 to 1, here in 8 bits."""
    values = np.array([[0.0, 1.0, 2.5], [-3.0, 0.25, 7.0]], np.float32)
    path = tmp_path / f"map.{suffix}"
    if suffix == "exr":
        image_files.write_exr(path, {"Y": values})
        expected = values
    else:
        values = np.array([[0.0, 1.0, 0.4], [0.2, 0.6, 0.8]], np.float32)
        image_files.write_png(path, values[..., None])
        expected = values
    entry = {"kind": "image", "file": str(path), "width": 6.0, "height": 10.0}
    surface = heights.surface_from_config(entry, 2.8)
    np.testing.assert_allclose(surface.pixels, 10 * expected, rtol=1e-6)
    assert surface.width == 6.0 and surface.beyond == "mirror"


def test_sixteen_bits_are_read_as_such(tmp_path):
    oiio = pytest.importorskip("OpenImageIO")
    values = np.array([[0, 1, 40001], [65535, 257, 2]], np.uint16)
    file = oiio.ImageOutput.create(str(tmp_path / "map.png"))
    file.open(str(tmp_path / "map.png"), oiio.ImageSpec(3, 2, 1, oiio.UINT16))
    file.write_image(values[..., None])
    file.close()
    np.testing.assert_allclose(heights.read_height_map(tmp_path / "map.png") * 65535, values, atol=0.01)


def test_hills_are_measured_in_tile_sides():
    assert heights.surface_from_config({"kind": "hills", "height": 2, "wavelength": 10}, 0.3) == Hills(0.6, 3.0, 4, 0)
    assert heights.surface_from_config({"kind": "flat"}, 0.3) == FlatSurface()


def test_an_image_too_large_is_refused_before_it_is_read(tmp_path, monkeypatch):
    image_files.write_png(tmp_path / "map.png", np.zeros((4, 5, 1)))
    monkeypatch.setattr(heights, "MAX_SIDE", 4)
    monkeypatch.setattr(image_files, "read_channel", None)
    with pytest.raises(InputError, match=r"map\.png: 5 x 4 pixels; at most 4 a side"):
        heights.read_height_map(tmp_path / "map.png")


def test_a_height_that_is_not_finite_is_named(tmp_path):
    values = np.zeros((3, 4), np.float32)
    values[1, 2] = np.nan
    image_files.write_exr(tmp_path / "map.exr", {"Y": values})
    with pytest.raises(InputError, match=r"map\.exr: the height in row 1, column 2 is not finite"):
        heights.read_height_map(tmp_path / "map.exr")


def tiff_map(folder, values, no_data=None):
    tags = [] if no_data is None else [(42113, "s", 0, no_data, True)]
    tifffile.imwrite(folder / "map.tif", np.array([values, values]), extratags=tags)
    return folder / "map.tif"


@pytest.mark.parametrize("value, height", [(1e36, 1e6), (-3.4028234663852886e38, 1.0)])
def test_a_height_that_the_factor_makes_too_large_is_named(tmp_path, value, height):
    path = tiff_map(tmp_path, np.float32([0, 1, value]))
    with pytest.raises(
        InputError, match=r"map\.tif: the height in row 0, column 2 times heights\.height is beyond 1e\+09"
    ):
        heights.surface_from_config({"kind": "image", "file": str(path), "width": 6.0, "height": height}, 2.8)


@pytest.mark.parametrize("kind", [np.int8, np.int16, np.int32])
def test_integers_with_a_sign_are_refused(tmp_path, kind):
    with pytest.raises(InputError, match=r"map\.tif: its integers have a sign \(int\d*\); save it as float32"):
        heights.read_height_map(tiff_map(tmp_path, np.array([1, -2, 3], kind)))


@pytest.mark.parametrize(
    "values, no_data",
    [
        (np.float32([1, 2, -9999]), "-9999"),
        (np.float32([1, 2, -3.4028234663852886e38]), "-3.4028234663852886e+38"),
        (np.uint16([1, 2, 65535]), "65535"),
        (np.uint16([1, 2, 0]), "0"),
        (np.uint8([1, 2, 255]), "255"),
    ],
)
def test_a_pixel_without_data_is_no_height(tmp_path, values, no_data):
    path = tiff_map(tmp_path, values, no_data)
    with pytest.raises(
        InputError, match=r"map\.tif: the height in row 0, column 2 is marked as no data \(2 such\); fill"
    ):
        heights.read_height_map(path)


@pytest.mark.parametrize("no_data", ["-9999", "nan", "none", "65533"])
def test_a_map_without_such_pixels_is_read(tmp_path, no_data):
    values = np.uint16([1, 65534, 65535])
    found = heights.read_height_map(tiff_map(tmp_path, values, no_data))
    np.testing.assert_allclose(found[0] * 65535, values, atol=0.01)


def test_a_file_that_is_no_image_is_named(tmp_path):
    (tmp_path / "map.png").write_text("no image")
    with pytest.raises(InputError, match=r"map\.png: not readable"):
        heights.read_height_map(tmp_path / "map.png")


def test_hills_kilometres_out_are_as_smooth_as_at_home():
    x = 4e6 + np.arange(0, 4, 2.0**-6)
    height, _ = Hills(1.0, 8.0, 4, 0).at(x, np.full(len(x), -3e6))
    assert max(abs(b - a) for a, b in pairwise(height)) <= Hills(1.0, 8.0, 4, 0).steepest * 2**-6
    assert len(np.unique(height)) == len(height)
