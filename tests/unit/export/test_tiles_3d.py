"""3D Tiles: the rules of the specification, every Gaussian of every level once, the place on the globe."""

import json

import numpy as np
import pytest
from fixtures.finite_cells import collect_cells
from fixtures.splat_files import read_glb_spz
from pyproj import Transformer

from dav_gswt.export.axes import Y_UP, turn_field
from dav_gswt.field import concatenate_fields
from dav_gswt.geometry.georeference import Georeference

PLACE = Georeference(47.1, 11.3, 600.0, 20.0, metres_per_unit=1.5)


def list_tiles(tile, parent=None):
    """All tiles with their parents, the root first."""
    return [(tile, parent), *(found for child in tile.get("children", []) for found in list_tiles(child, tile))]


def find_ends(volume):
    """The corners of an axis-aligned box."""
    centre, axes = np.array(volume["box"][:3]), np.array(volume["box"][3:]).reshape(3, 3)
    assert (axes == np.diag(np.diag(axes))).all() and (np.diag(axes) > 0).all()
    return centre - np.diag(axes), centre + np.diag(axes)


def assert_inside(inner, outer):
    (low, high), (least, most) = find_ends(inner), find_ends(outer)
    assert (low >= least - 1e-9).all() and (high <= most + 1e-9).all()


@pytest.fixture
def write(export, tmp_path):
    """A function that exports 5 x 3 cells; the folder of tileset.json and what is in it."""

    def write(**changes):
        export("out", **({"columns": 5, "rows": 3, "formats": ["3dtiles"]} | changes))
        folder = tmp_path / "out/terrain_3dtiles"
        return folder, json.loads((folder / "tileset.json").read_text())

    return write


def test_the_tree_keeps_the_rules_of_the_specification(write):
    folder, tileset = write()
    root = tileset["root"]
    assert tileset["asset"]["version"] == "1.1" and tileset["geometricError"] >= root["geometricError"]
    assert root["refine"] == "REPLACE" and "transform" not in root and "content" not in root
    tiles = list_tiles(root)
    for tile, parent in tiles[1:]:
        assert 0 <= tile["geometricError"] < parent["geometricError"]
        assert_inside(tile["boundingVolume"], parent["boundingVolume"])
        assert_inside(tile["content"]["boundingVolume"], tile["boundingVolume"])
        assert bool(tile["geometricError"]) == ("children" in tile)
    uris = [tile["content"]["uri"] for tile, _ in tiles[1:]]
    there = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.glb"))
    assert sorted(uris) == there and len(there) == 15 + 3 * 2
    for tile, _ in tiles[1:]:
        points = turn_field(read_glb_spz(folder / tile["content"]["uri"]), Y_UP.T).means
        low, high = find_ends(tile["content"]["boundingVolume"])
        assert (points > low).all() and (points < high).all()


def test_every_level_has_the_gaussians_of_the_terrain(write, cover_terrain):
    folder, tileset = write(level=1)  # which the set does not heed
    west, south = tileset["extras"]["cells"]["west"], tileset["extras"]["cells"]["south"]
    corner = np.array([west, south, 0]) * cover_terrain.side - tileset["extras"]["origin"]
    for level in (0, 1):
        parts = [read_glb_spz(path) for path in sorted(folder.glob(f"{level}/*.glb"))]
        found = turn_field(concatenate_fields(parts), Y_UP.T)
        wanted = collect_cells(cover_terrain, west, south, 5, 3, level)
        np.testing.assert_allclose(np.sort(found.means, 0), np.sort(wanted.means + corner, 0), atol=1e-3)
        np.testing.assert_allclose(np.sort(found.log_scales, 0), np.sort(wanted.log_scales, 0), atol=1 / 32 + 1e-4)
    extension = tileset["extensions"]["3DTILES_content_gltf"]
    assert extension["extensionsRequired"] == ["KHR_gaussian_splatting", "KHR_gaussian_splatting_compression_spz_2"]


def test_a_georeferenced_tileset_stands_where_pyproj_puts_it(write):
    _, tileset = write(reference=PLACE, centre=[7.0, -3.0], columns=2, rows=1)
    matrix = np.array(tileset["root"]["transform"]).reshape(4, 4).T
    origin = np.array(tileset["extras"]["origin"])
    assert np.abs(origin[:2]).max() > 5
    project = Transformer.from_crs("EPSG:4979", "EPSG:4978")
    for local in np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0], [0, 0, 10]]):
        wanted = project.transform(*PLACE.to_earth((origin + local)[None])[0])
        np.testing.assert_allclose(matrix @ [*local, 1.0], [*wanted, 1.0], atol=1e-6)
