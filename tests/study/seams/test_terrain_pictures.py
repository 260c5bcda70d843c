"""Large pictures of the terrain: all of its materials and objects are in them."""

import numpy as np
import pytest
from fixtures.land_covers import GRASS, LEAF, SAND, write_cover_bundle

from dav_gswt.bundle import store
from dav_gswt.study.seams import pictures


@pytest.fixture(scope="module")
def bundle(tmp_path_factory, root):
    folder, schema = tmp_path_factory.mktemp("cover") / "bundle", root / "workflow/schemas/davgswt.schema.json"
    write_cover_bundle(folder, schema)
    return store.read_bundle(folder, schema)


@pytest.mark.parametrize("surface", ["flat", "hilly"])
def test_the_grid_shows_every_material_and_the_objects(bundle, surface, monkeypatch):
    monkeypatch.setattr(pictures, "SQUARE", 200)
    monkeypatch.setattr(pictures, "TILES", 4)
    shots = pictures.render_terrain_pictures(bundle, surface, {"width": 32, "height": 18})
    assert list(shots) == ["grid", "walker"] and shots["walker"].shape == (18, 32, 3)
    seen = shots["grid"]
    assert seen.shape == (200, 200, 3) and np.isfinite(seen).all()
    for colour in (SAND, GRASS, LEAF):
        assert (np.abs(seen - colour).max(-1) < 0.08).mean() > 0.002
