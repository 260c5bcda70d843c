"""The ground of a finite terrain: mesh, images, model and hulls lie where the splats do; simplified heights."""

import json
from dataclasses import replace

import numpy as np
import pytest
from fixtures.finite_cells import collect_cells
from fixtures.land_covers import cover_content
from fixtures.splat_files import read_glb
from scipy.ndimage import map_coordinates
from scipy.spatial import ConvexHull

from dav_gswt.errors import InputError
from dav_gswt.export import ground_files
from dav_gswt.export.axes import Y_UP
from dav_gswt.export.height_mesh import simplify_heights
from dav_gswt.export.terrain_files import find_origin
from dav_gswt.geometry import cameras
from dav_gswt.images import image_files
from dav_gswt.raster import render
from dav_gswt.terrain import endless, finite
from dav_gswt.terrain.finite import Area
from dav_gswt.terrain.heights import make_sphere

AREA = Area(0, -1, 6, 5)


@pytest.fixture(scope="module")
def settings(export_settings):
    return export_settings | {"centre": [3.0, 1.5], "columns": AREA.columns, "rows": AREA.rows}


@pytest.fixture(scope="module")
def sets():
    return cover_content().tiles


@pytest.fixture(scope="module")
def surface(cover_terrain, sets):
    return ground_files.collect_surface(cover_terrain, ground_files.measure_tiles(sets), AREA)


@pytest.fixture(scope="module")
def exported(cover_bundle, cover_terrain, sets, settings, tmp_path_factory):
    out = tmp_path_factory.mktemp("ground") / "out"
    ground_files.export_ground(cover_terrain, cover_bundle.manifest, sets, settings, out)
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


def sample_surface(surface, x, y):
    """Bilinear heights at places of the world."""
    at = [(v - first) / surface.step for v, first in ((y, surface.south), (x, surface.west))]
    return map_coordinates(surface.heights.astype(float), at, order=1, mode="nearest")


def test_heights_are_those_that_a_camera_above_sees(cover_terrain, surface):
    """Of the whole terrain without its objects: the blades of the grass are thin."""
    bare = replace(cover_terrain, scatter=None, objects=[])
    field = collect_cells(bare, *(AREA.west, AREA.south, AREA.columns, AREA.rows), 0)
    pixel = surface.cell
    size = [int(n * cover_terrain.side / pixel) for n in (AREA.columns, AREA.rows)]
    seen = render(field, cameras.top_down(0.0, 0.0, *size, pixel, 10.0))  # `collect_cells` counts from the corner
    rng = np.random.default_rng(0)
    column, row = (rng.integers(0, n, 1000) for n in size)
    shown = 10 - seen.depth[::-1][row, column] / seen.alpha[::-1][row, column]
    x, y = ((k + 0.5) * pixel + first * cover_terrain.side for k, first in ((column, AREA.west), (row, AREA.south)))
    assert (np.abs(sample_surface(surface, x, y) - shown) < surface.cell).mean() >= 0.99


def test_of_several_materials_the_one_that_lies_there_is_taken(cover_terrain, sets):
    raised = [sets[0], replace(sets[1], fields=[[_lift(f, 0.5) for f in level] for level in sets[1].fields])]
    tiles = ground_files.measure_tiles(raised)
    flat = replace(cover_terrain, heights=endless.FlatSurface())
    area = Area(-4, -4, 8, 8)
    heights = ground_files.collect_surface(flat, tiles, area).heights
    low, high = (heights < 0.05).mean(), (heights > 0.45).mean()
    assert low > 0.1 and high > 0.1 and low + high > 0.6  # a blur of one cell lies between


def _lift(field, by):
    return replace(field, means=field.means + np.outer(by * np.ones(len(field)), [0, 0, 1]).astype(np.float32))


def test_a_planet_and_too_many_points_are_refused(cover_terrain, sets, cover_bundle, settings, tmp_path):
    planet = replace(cover_terrain, heights=make_sphere(8.0, cover_terrain.side))
    with pytest.raises(InputError, match="heights: a rectangle of cells is cut from a plane"):
        ground_files.check_ground(planet, sets, settings)
    given = settings | {"columns": 1000, "rows": 1000}
    with pytest.raises(
        InputError, match=r"ground: 1000 x 1000 cells have .* points, at most \d+ .* set export\.columns"
    ):
        ground_files.export_ground(cover_terrain, cover_bundle.manifest, sets, given, tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_the_mesh_lies_on_the_surface_in_the_frame_of_the_splats(exported, facts, cover_terrain, surface):
    ((node, vertices, triangles),) = read_meshes(exported / "ground.glb")
    assert node["extras"]["error"] == facts["mesh"]["error"] == pytest.approx(0.25 * surface.cell)
    assert (len(vertices), len(triangles)) == (facts["mesh"]["vertices"], facts["mesh"]["triangles"])
    assert len(triangles) == len(simplify_heights(surface.heights, surface.block, 0.25 * surface.cell)[1])
    half, origin = np.array([AREA.columns, AREA.rows]) * cover_terrain.side / 2, find_origin(cover_terrain, AREA)
    np.testing.assert_allclose([vertices.min(0)[:2], vertices.max(0)[:2]], [-half, half], atol=1e-5)
    wanted = sample_surface(surface, *(vertices[:, :2] + origin[:2]).T)
    np.testing.assert_allclose(vertices[:, 2], wanted, atol=1e-4)
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_images_hold_the_heights_from_the_north(exported, facts, surface):
    known, heights = facts["heights"], surface.heights[::-1]
    png = image_files.read_channel(exported / "ground.png") * 65535
    np.testing.assert_allclose(
        png * known["png"]["scale"] + known["png"]["offset"], heights, atol=known["png"]["scale"]
    )
    assert png.min() == 0 and png.max() == 65535 and png.shape == (known["rows"], known["columns"])
    assert known["north_west"] == pytest.approx([-3 * 4.0, 2.5 * 4.0])


def test_every_object_has_a_closed_hull_that_holds_what_is_drawn(exported, facts, cover_terrain):
    cells = finite.list_cells(cover_terrain, AREA)
    found = cover_terrain.scatter.instances_in(cells.i, cells.j)
    meshes = list(read_meshes(exported / "objects.glb"))
    assert len(meshes) == len(found) == facts["objects"] > 0
    bare = len(collect_cells(replace(cover_terrain, scatter=None, objects=[]), 0, -1, 6, 5, 0))
    drawn = collect_cells(cover_terrain, 0, -1, 6, 5, 0)[bare:].means.reshape(len(found), -1, 3)
    corner = np.array([0, -cover_terrain.side, 0]) - find_origin(cover_terrain, AREA)
    for (node, vertices, triangles), centres in zip(meshes, drawn, strict=True):
        assert node["name"].startswith("shrub") and node["extras"]["convex"]
        edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        assert np.einsum("ni,ni->", a, np.cross(b, c)) > 0  # outward
        hull = ConvexHull(vertices)
        outside = hull.equations[:, :3] @ (centres + corner).T + hull.equations[:, 3:]
        assert outside.max() < 0.05 and hull.volume < 1


def test_mujoco_loads_the_model_and_its_rays_meet_the_heights(exported, facts, surface):
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
    rows, columns = np.fromfile(exported / "ground.hfield", "<i4", 2)
    heights = np.fromfile(exported / "ground.hfield", "<f4", offset=8).reshape(rows, columns)
    np.testing.assert_array_equal(heights, surface.heights)
    model = mujoco.MjModel.from_xml_path(str(exported / "ground.xml"))
    assert model.nmesh == facts["objects"] and model.ngeom == 1 + facts["objects"]
    assert model.hfield_size[0, 3] == pytest.approx(2.0)  # half a tile below the lowest point
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    known, hit = facts["heights"], np.zeros(1, np.int32)
    for row, column in np.random.default_rng(2).integers([1, 1], [rows - 1, columns - 1], (200, 2)):
        x, y = known["north_west"][0] + column * known["step"], known["north_west"][1] - row * known["step"]
        away = mujoco.mj_ray(model, data, np.array([x + 1e-4, y - 1e-4, 20]), np.array([0, 0, -1.0]), None, 1, -1, hit)
        name, here = model.geom(hit[0]).name, heights[::-1][row, column]
        assert name != "ground" or abs(20 - away - here) < 2e-3
        assert name == "ground" or 20 - away > here - 0.1  # an object stands there


BLOCK = 16


def rough():
    y, x = np.mgrid[: 2 * BLOCK + 1, : 3 * BLOCK + 1]
    wave = np.sin(x / 9) * np.cos(y / 7)
    return (wave + 0.02 * np.random.default_rng(0).normal(size=x.shape)).astype(np.float32)


def fill(heights, points, triangles):
    """Heights of the triangles at all lattice points; fails where two triangles disagree on one."""
    found, area = np.full(heights.shape, np.nan), 0.0
    for corners in points[triangles]:
        (r, c), z = corners.T, heights[tuple(corners.T)].astype(float)
        twice = (c[1] - c[0]) * (r[2] - r[0]) - (c[2] - c[0]) * (r[1] - r[0])
        assert twice > 0  # counter-clockwise from above
        area += twice / 2
        rows, columns = np.mgrid[r.min() : r.max() + 1, c.min() : c.max() + 1].reshape(2, -1)
        weights = np.linalg.solve(np.array([c, r, np.ones(3)], float), [columns, rows, np.ones(len(rows))])
        inside = (weights > -1e-9).all(0)
        place, value = (rows[inside], columns[inside]), z @ weights[:, inside]
        assert np.nanmax(np.abs(found[place] - value), initial=0) < 1e-5
        found[place] = value
    assert area == (heights.shape[0] - 1) * (heights.shape[1] - 1)
    return found


@pytest.mark.parametrize("tolerance", [0.0, 0.05, 0.2, 0.6])
def test_no_point_is_off_by_more_than_the_tolerance(tolerance):
    heights = rough()
    points, triangles = simplify_heights(heights, BLOCK, tolerance)
    assert np.abs(fill(heights, points, triangles) - heights).max() <= tolerance + 1e-6


def test_larger_tolerances_need_fewer_triangles_and_a_plane_two_a_block():
    counts = [len(simplify_heights(rough(), BLOCK, tolerance)[1]) for tolerance in (0.0, 0.02, 0.1, 0.5, 5.0)]
    assert counts == sorted(counts, reverse=True) and counts[0] == 2 * 32 * 48 and counts[-1] == 2 * 6
    y, x = np.mgrid[: BLOCK + 1, : 2 * BLOCK + 1]
    points, triangles = simplify_heights((0.5 * x - 0.25 * y).astype(np.float32), BLOCK, 1e-5)
    assert len(triangles) == 4 and len(points) == 6
