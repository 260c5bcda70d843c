"""The ground of a finite terrain: mesh, images, model and hulls lie where the splats do."""

import json
import xml.etree.ElementTree as xml
from dataclasses import replace

import numpy as np
import pytest
import tifffile
from fixtures.land_covers import cover_content
from fixtures.splat_files import read_glb
from scipy.spatial import ConvexHull

from dav_gswt.errors import InputError
from dav_gswt.export import ground_files, ground_surface, hulls
from dav_gswt.export.axes import Y_UP
from dav_gswt.export.terrain_area import find_origin
from dav_gswt.geometry import cameras
from dav_gswt.geometry.georeference import Georeference
from dav_gswt.images import image_files
from dav_gswt.raster import render
from dav_gswt.terrain import endless, finite
from dav_gswt.terrain.finite import Area
from dav_gswt.terrain.sphere import make_sphere

PLACE = Georeference(47.1, 11.3, 600.0, 20.0, metres_per_unit=1.0)
AREA = Area(0, -1, 6, 5)


@pytest.fixture(scope="module")
def settings(export_settings):
    place = {"corner": [AREA.west, AREA.south], "columns": AREA.columns, "rows": AREA.rows}
    return {key: value for key, value in export_settings.items() if key != "centre"} | place


@pytest.fixture(scope="module")
def sets():
    return cover_content().tiles


@pytest.fixture(scope="module")
def terrain(cover_bundle, hills):
    return endless.terrain_from_bundle(cover_bundle, hills)


@pytest.fixture(scope="module")
def surface(terrain, sets):
    return ground_surface.collect_surface(terrain, ground_surface.measure_tiles(sets), AREA)


@pytest.fixture(scope="module")
def exported(cover_bundle, terrain, sets, settings, tmp_path_factory):
    out = tmp_path_factory.mktemp("ground") / "out"
    ground_files.export_ground(terrain, cover_bundle.manifest, sets, PLACE, settings, out)
    return out


@pytest.fixture(scope="module")
def facts(exported):
    return json.loads((exported / "ground.json").read_text())


def read_meshes(path):
    """Name, vertices in our axes and triangles of every node."""
    document, values = read_glb(path)
    for node in document["nodes"]:
        (primitive,) = document["meshes"][node["mesh"]]["primitives"]
        assert primitive["mode"] == 4
        vertices = values[primitive["attributes"]["POSITION"]] @ Y_UP
        yield node, vertices, values[primitive["indices"]].reshape(-1, 3)


def test_a_planet_is_refused_before_any_work(cover_bundle, terrain, sets, settings):
    planet = replace(terrain, heights=make_sphere(8.0, terrain.side))
    with pytest.raises(InputError, match="heights: a rectangle of cells is cut from a plane"):
        ground_files.check_ground(planet, cover_bundle.manifest, sets, PLACE, settings)


def test_heights_are_those_that_a_camera_above_sees(terrain, surface):
    """Of the whole terrain without its objects: the blades of the grass are thin."""
    bare = replace(terrain, scatter=None, objects=[])
    field = finite.collect_cells(bare, *(AREA.west, AREA.south, AREA.columns, AREA.rows), 0)
    pixel = surface.cell
    size = [int(n * terrain.side / pixel) for n in (AREA.columns, AREA.rows)]
    corner = 0.0, 0.0  # of what `collect_cells` counts from
    seen = render(field, cameras.top_down(*corner, *size, pixel, 10.0))
    rng = np.random.default_rng(0)
    column, row = (rng.integers(0, n, 1000) for n in size)
    shown = 10 - seen.depth[::-1][row, column] / seen.alpha[::-1][row, column]
    x, y = ((k + 0.5) * pixel + first * terrain.side for k, first in ((column, AREA.west), (row, AREA.south)))
    assert (np.abs(ground_surface.sample_surface(surface, x, y) - shown) < surface.cell).mean() >= 0.99


def test_the_ground_layer_alone_is_taken_and_blades_only_where_all_is_asked_for(sets):
    ground, visible = (ground_surface.measure_tiles(sets, whole).heights for whole in (False, True))
    assert np.abs(ground).max() < 1e-3 and visible[16:].max() > 0.05
    assert ground.shape == (32, 17, 17)


def test_at_a_border_the_neighbour_is_seen_too(sets):
    """A ridge along the western border of every tile is there at the eastern one, which its neighbour's covers."""
    ridge = [[_raise_west(field) for field in level] for level in sets[0].fields]
    heights = ground_surface.measure_tiles([replace(sets[0], fields=ridge)]).heights
    assert heights[:, :, 0].min() > 0.1 and heights[:, :, 8].max() < 0.01
    np.testing.assert_allclose(heights[:, 1:-1, -1], heights[:, 1:-1, 0], atol=0.02)


def _raise_west(field):
    west = field.means[:, 0] < 0.3
    return replace(field, means=field.means + 0.3 * np.stack([0 * west, 0 * west, west], 1).astype(np.float32))


def test_of_several_materials_the_one_that_lies_there_is_taken(terrain, sets):
    raised = [sets[0], replace(sets[1], fields=[[_lift(f, 0.5) for f in level] for level in sets[1].fields])]
    tiles = ground_surface.measure_tiles(raised)
    flat = replace(terrain, heights=endless.FlatSurface())
    area = Area(-4, -4, 8, 8)
    heights = ground_surface.collect_surface(flat, tiles, area).heights
    low, high = (heights < 0.05).mean(), (heights > 0.45).mean()
    assert low > 0.1 and high > 0.1 and low + high > 0.6  # a blur of one cell lies between


def _lift(field, by):
    return replace(field, means=field.means + np.float32([0, 0, by]))


def test_a_field_without_a_ground_layer_is_taken_whole(sets):
    plain = [replace(sets[0], fields=[[replace(f, ground=np.zeros(len(f), bool)) for f in sets[0].fields[0]]])]
    assert np.abs(ground_surface.measure_tiles(plain).heights).max() < 1e-3


def test_too_many_points_are_refused_with_the_area_that_fits(terrain, sets, cover_bundle, settings, tmp_path):
    given = settings | {"columns": 1000, "rows": 1000}
    with pytest.raises(InputError, match=r"ground: 1000 x 1000 cells have .* points, at most \d+ are written; (\d+) x"):
        ground_files.export_ground(terrain, cover_bundle.manifest, sets, None, given, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_the_mesh_is_within_its_stated_error_in_the_frame_of_the_splats(exported, facts, terrain, surface):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    ((node, vertices, triangles),) = read_meshes(exported / "ground.glb")
    assert node["extras"]["error"] == facts["mesh"]["error"] == pytest.approx(0.25 * surface.cell)
    assert (len(vertices), len(triangles)) == (facts["mesh"]["vertices"], facts["mesh"]["triangles"])
    half = np.array([AREA.columns, AREA.rows]) * terrain.side / 2
    np.testing.assert_allclose([vertices.min(0)[:2], vertices.max(0)[:2]], [-half, half], atol=1e-5)
    mesh = trimesh.Trimesh(vertices, triangles, process=False)
    assert (mesh.face_normals[:, 2] > 0).all()
    xy = np.random.default_rng(1).uniform(-half, half, (500, 2)) * 0.999
    above = np.concatenate([xy, np.full((500, 1), 50.0)], 1)
    hits, rays, _ = mesh.ray.intersects_location(above, np.tile([0, 0, -1.0], (500, 1)), multiple_hits=False)
    origin = find_origin(terrain, AREA)
    wanted = ground_surface.sample_surface(surface, *(xy[rays] + origin[:2]).T)
    assert len(rays) == 500 and np.abs(hits[:, 2] - wanted).max() <= facts["mesh"]["error"] + 0.1 * surface.cell


def test_images_hold_the_heights_from_the_north(exported, facts, surface):
    known, tiff = facts["heights"], tifffile.imread(exported / "ground.tif")
    np.testing.assert_array_equal(tiff[::-1], surface.heights)
    png = image_files.read_channel(exported / "ground.png") * 65535
    np.testing.assert_allclose(png * known["png"]["scale"] + known["png"]["offset"], tiff, atol=known["png"]["scale"])
    assert png.min() == 0 and png.max() == 65535 and tiff.shape == (known["rows"], known["columns"])
    assert known["north_west"] == pytest.approx([-3 * 4.0, 2.5 * 4.0])


def test_a_scene_of_unknown_place_gives_a_plain_tiff(cover_bundle, terrain, sets, settings, tmp_path):
    ground_files.export_ground(terrain, cover_bundle.manifest, sets, None, settings, tmp_path / "out")
    with tifffile.TiffFile(tmp_path / "out/ground.tif") as tiff:
        assert not {34264, 34735} & {tag.code for tag in tiff.pages[0].tags}
    assert json.loads((tmp_path / "out/ground.json").read_text())["map"] is None


def test_the_same_input_gives_the_same_bytes(cover_bundle, terrain, sets, settings, exported, tmp_path):
    ground_files.export_ground(terrain, cover_bundle.manifest, sets, PLACE, settings, tmp_path / "out")
    for path in exported.iterdir():
        assert (tmp_path / "out" / path.name).read_bytes() == path.read_bytes(), path.name


def test_every_object_has_a_closed_hull_that_holds_what_is_drawn(exported, facts, terrain):
    i, j, _, _ = finite.list_cells(terrain, AREA.west, AREA.south, AREA.columns, AREA.rows)
    found = terrain.scatter.instances_in(i, j)
    meshes = list(read_meshes(exported / "objects.glb"))
    assert len(meshes) == len(found) == facts["objects"] > 0
    bare = len(finite.collect_cells(replace(terrain, scatter=None, objects=[]), 0, -1, 6, 5, 0))
    drawn = finite.collect_cells(terrain, 0, -1, 6, 5, 0)[bare:].means.reshape(len(found), -1, 3)
    corner = np.array([0, -terrain.side, 0]) - find_origin(terrain, AREA)
    for (node, vertices, triangles), centres in zip(meshes, drawn, strict=True):
        assert node["name"].startswith("shrub") and node["extras"]["convex"]
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        assert np.einsum("ni,ni->", a, np.cross(b, c)) > 0  # outward
        hull = ConvexHull(vertices)
        outside = hull.equations[:, :3] @ (centres + corner).T + hull.equations[:, 3:]
        assert outside.max() < 0.05 and hull.volume < 1


def test_a_flat_object_has_no_hull():
    assert hulls.wrap(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]])) is None


def test_the_model_names_files_and_meshes_that_are_there(exported, facts, surface):
    model = xml.parse(exported / "ground.xml").getroot()
    field = model.find("asset/hfield")
    assert (exported / field.get("file")).is_file()
    rows, columns = np.fromfile(exported / "ground.hfield", "<i4", 2)
    heights = np.fromfile(exported / "ground.hfield", "<f4", offset=8).reshape(rows, columns)
    np.testing.assert_array_equal(heights, surface.heights)
    names = {mesh.get("name") for mesh in model.findall("asset/mesh")}
    used = {geom.get("mesh") for geom in model.findall("worldbody/geom") if geom.get("mesh")}
    assert names == used and len(names) == facts["objects"]
