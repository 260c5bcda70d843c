"""Height fields: the numbers shared with the page, and height maps that are read or refused."""

import json
from pathlib import Path

import numpy as np
import pytest
import tifffile

from dav_gswt.errors import InputError
from dav_gswt.images import image_files
from dav_gswt.terrain import heights
from dav_gswt.terrain.heights import FlatSurface, HeightField, HeightMap, Hills

GOLDEN = json.loads((Path(__file__).parents[2] / "golden" / "heights.json").read_text())["surfaces"]


def surface_of(entry) -> HeightField:
    if entry["kind"] == "hills":
        return Hills(*(entry[key] for key in ("height", "wavelength", "octaves", "salt")))
    return HeightMap(np.array(entry["pixels"], np.float32), entry["width"])


@pytest.mark.parametrize("entry", GOLDEN, ids=lambda e: e["kind"])
def test_numbers_are_those_shared_with_the_page(entry):
    surface = surface_of(entry)
    points = entry["points"]
    height, slope = surface.at(*(np.array([p[key] for p in points]) for key in "xy"))
    # the order of sums may differ between languages; nothing here is larger than about 10
    np.testing.assert_allclose(height, [p["height"] for p in points], rtol=0, atol=1e-9)
    np.testing.assert_allclose(slope, [p["slope"] for p in points], rtol=0, atol=1e-9)
    np.testing.assert_allclose(surface.bounds, [entry[key] for key in ("low", "high", "steepest")], rtol=1e-12)


def test_surfaces_are_those_of_the_config(tmp_path):
    """Hills are measured in tile sides; EXR keeps floats as they are, beyond 1 and below 0 too."""
    hills = {"kind": "hills", "height": 2, "wavelength": 10}
    assert heights.surface_from_config(hills, 0.3, 1.0) == Hills(0.6, 3.0, 4, 0)
    assert heights.surface_from_config({"kind": "flat"}, 0.3, 1.0) == FlatSurface()
    assert heights.surface_from_config({"kind": "sphere", "radius": 10.0}, 0.3, 1.0).radius == 3
    values = np.array([[0.0, 1.0, 2.5], [-3.0, 0.25, 7.0]], np.float32)
    image_files.write_exr(tmp_path / "map.exr", {"Y": values})
    entry = {"kind": "image", "file": str(tmp_path / "map.exr"), "width": 6.0, "height": 10.0}
    surface = heights.surface_from_config(entry, 2.8, 1.0)
    np.testing.assert_allclose(surface.pixels, 10 * values, rtol=1e-6)
    assert surface.width == 6.0


def write_map(folder, values, no_data=None):
    tags = [] if no_data is None else [(42113, "s", 0, no_data, True)]
    tifffile.imwrite(folder / "map.tif", np.array([values, values]), extratags=tags)
    return folder / "map.tif"


@pytest.mark.parametrize("no_data", [None, "-9999", "nan", "none", "65533"])
def test_sixteen_bits_are_read_as_such(tmp_path, no_data):
    values = np.uint16([1, 65534, 65535])
    found = heights.read_height_map(write_map(tmp_path, values, no_data))
    np.testing.assert_allclose(found[0] * 65535, values, atol=0.01)


@pytest.mark.parametrize(
    "values, no_data, said",
    [
        (np.float32([0, np.nan, 0]), None, "row 0, column 1 is not finite"),
        (np.int16([1, -2, 3]), None, r"its integers have a sign \(int16\)"),
        (np.float32([1, 2, -9999]), "-9999", r"row 0, column 2 is marked as no data \(2 such\); fill"),
        (np.uint16([1, 2, 65535]), "65535", "no data"),
        (np.float32([0, 1, 1e36]), None, r"row 0, column 2 times heights\.height is beyond 1e\+09"),
        (np.zeros(5, np.float32), None, "5 x 2 pixels; at most 4 a side"),
    ],
)
def test_a_bad_height_map_is_refused_by_name(tmp_path, monkeypatch, values, no_data, said):
    monkeypatch.setattr(heights, "MAX_SIDE", 4)
    entry = {"kind": "image", "file": str(write_map(tmp_path, values, no_data)), "width": 6.0, "height": 1e6}
    with pytest.raises(InputError, match=rf"map\.tif: .*{said}"):
        heights.surface_from_config(entry, 2.8, 1.0)
