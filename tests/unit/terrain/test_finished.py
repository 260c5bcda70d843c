"""A page folder as a terrain in Python: the same surface and classes as the config gave; nothing damaged passes."""

import json

import numpy as np
import pytest
from fixtures.land_covers import write_cover_bundle

from dav_gswt.bundle import store
from dav_gswt.errors import InputError
from dav_gswt.terrain import endless, finished
from dav_gswt.terrain.heights import FlatSurface, HeightMap, Hills
from dav_gswt.terrain.page import write_page

SURFACES = {
    "flat": FlatSurface(),
    "hills": Hills(2.0, 30.0, 3, 5),
    "image": HeightMap(np.random.default_rng(1).uniform(0, 3, (9, 7)).astype(np.float32), 60.0, "clamp"),
}
RULE = [{"kind": "noise"}, {"kind": "height", "material": "grass", "low": 0.1, "soft": 0.2}]


@pytest.fixture
def page_of(root, tmp_path):
    """Make the page folder of two materials on a surface."""
    schema = root / "workflow/schemas/davgswt.schema.json"

    def make(surface, rule=RULE):
        write_cover_bundle(tmp_path / "bundle", schema)
        write_page(tmp_path / "bundle", root / "workflow/viewer", tmp_path / "page", surface, rule)
        return tmp_path / "page", schema

    return make


@pytest.mark.parametrize("name", SURFACES)
def test_a_page_is_the_terrain_that_it_was_made_of(page_of, tmp_path, name):
    page, schema = page_of(SURFACES[name])
    terrain = finished.terrain_from_page(store.read_bundle(page, schema))
    x, y = np.random.default_rng(2).uniform(-50, 50, (2, 40))
    np.testing.assert_array_equal(terrain.heights.at(x, y)[0], SURFACES[name].at(x, y)[0])
    bundle = store.read_bundle(tmp_path / "bundle", schema)
    wanted = endless.terrain_from_bundle(bundle, {"kind": "flat"}, RULE)
    assert terrain.classes is not None and wanted.classes is not None
    if name == "flat":  # a rule of heights needs the same surface
        points = np.random.default_rng(3).integers(-60, 60, (2, 200))
        np.testing.assert_array_equal(terrain.classes.lattice_scores(*points), wanted.classes.lattice_scores(*points))
    assert terrain.side == wanted.side and len(terrain.objects) == len(wanted.objects)


def test_a_picture_of_materials_comes_from_the_page(page_of, tmp_path):
    from PIL import Image

    colours = np.array([[[200, 180, 120], [60, 120, 50]]], np.uint8).repeat(2, 0)
    Image.fromarray(colours).save(tmp_path / "m.png")
    file = str(tmp_path / "m.png")
    rule = [{"kind": "image", "file": file, "width": 40.0, "colours": {"sand": "#c8b478", "grass": "#3c7832"}}]
    page, schema = page_of(FlatSurface(), rule)
    terrain = finished.terrain_from_page(store.read_bundle(page, schema))
    scores = terrain.classes.lattice_scores(np.array([-20, 20]), np.array([0, 0]))
    assert scores.argmax(1).tolist() == [0, 1]


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"rows": 10}, "bytes instead of"),
        ({"rows": -1}, "a size is out of range"),
        ({"rows": "many"}, "make no sense"),
        ({"file": "../heights.bin"}, "does not lie beside it"),
        ({"file": "nowhere.bin"}, "missing"),
        ({"sha256": "0" * 64}, "damaged"),
        ({"kind": "hills"}, "make no sense"),
        ({"kind": "torus"}, "is not one of"),
    ],
)
def test_what_is_damaged_is_named(page_of, changes, said):
    page, schema = page_of(SURFACES["image"])
    manifest = json.loads((page / "davgswt.json").read_text())
    manifest["heights"] |= changes
    (page / "davgswt.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match=said):
        finished.terrain_from_page(store.read_bundle(page, schema))
