"""What is written, read by programs that others wrote. Each test is skipped where its program cannot be had."""

import json
import subprocess
import sys

import numpy as np
import pytest
from fixtures.splat_files import read_glb_splats

from dav_gswt.export import spz, terrain_files
from dav_gswt.export.axes import Y_DOWN, Y_UP, turn_field
from dav_gswt.field import read_field
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render

SIZE = 128
VALIDATE = """
import fs from 'fs';
import validator from 'gltf-validator';
const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])));
console.log(JSON.stringify(report));
"""
THREE = """
import fs from 'fs';
globalThis.self = globalThis;
const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
const { GLTFGaussianSplatLoaderExtension } = await import('three/addons/loaders/GLTFGaussianSplatLoaderExtension.js');
const bytes = fs.readFileSync(process.argv[2]);
const told = [];
for (const splats of [true, false]) {
  const loader = new GLTFLoader();
  if (splats) loader.register((parser) => new GLTFGaussianSplatLoaderExtension(parser));
  const gltf = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');
  gltf.scene.traverse((object) => {
    if (!object.geometry) return;
    const attributes = Object.entries(object.geometry.attributes).map(([name, a]) => [name, a.count]);
    told.push([object.constructor.name, object.userData.unit ?? null, Object.fromEntries(attributes)]);
  });
}
console.log(JSON.stringify(told));
"""


@pytest.fixture(scope="module")
def exported(cover_bundle, hills, export_settings, tmp_path_factory):
    """A finite terrain in the formats that need no other program."""
    from dav_gswt.terrain import endless

    out = tmp_path_factory.mktemp("terrain") / "out"
    terrain = endless.terrain_from_bundle(cover_bundle, hills)
    terrain_files.export_terrain(
        terrain, cover_bundle.manifest, export_settings | {"formats": ["ply", "spz", "glb"]}, out
    )
    return out


def take_picture(field, back):
    """A picture of a field whose axes are turned back to ours."""
    camera = cameras.pinhole(np.array([4.0, -9.0, 5.0]), np.zeros(3), SIZE, SIZE, 50.0)
    return render(turn_field(field, back), camera, 0.5).colour


def test_gltf_validator_knows_all_but_the_extension(exported, run_node):
    """Its version of 2024 knows no attribute of the extension; it finds nothing else."""
    issues = json.loads(run_node(VALIDATE, exported / "terrain.glb"))["issues"]["messages"]
    codes = {issue["code"] for issue in issues}
    assert codes == {"UNSUPPORTED_EXTENSION", "MESH_PRIMITIVE_INVALID_ATTRIBUTE"}
    named = [issue["pointer"].rpartition("/")[2] for issue in issues if issue["severity"] == 0]
    assert len(named) == 4 and all(name.startswith("KHR_gaussian_splatting:") for name in named)


@pytest.mark.parametrize("how, names", [("spz", {"SCALE", "ROTATION"}), ("none", {"SCALE", "ROTATION", "OPACITY"})])
def test_gltf_validator_knows_all_of_3d_tiles_but_the_extensions(
    cover_bundle, cover_terrain, export_settings, run_node, tmp_path, how, names
):
    """Without the extension it sees that nothing it knows uses the view of the SPZ."""
    settings = export_settings | {"formats": ["3dtiles"], "tile_compression": how}
    terrain_files.export_terrain(cover_terrain, cover_bundle.manifest, settings, tmp_path / "out")
    for path in sorted((tmp_path / "out/terrain_3dtiles").rglob("*.glb"))[:2]:
        issues = json.loads(run_node(VALIDATE, path))["issues"]["messages"]
        known = {"UNSUPPORTED_EXTENSION", "MESH_PRIMITIVE_INVALID_ATTRIBUTE"} | (
            {"UNUSED_OBJECT"} if how == "spz" else set()
        )
        assert {issue["code"] for issue in issues} == known
        named = {issue["pointer"].rpartition(":")[2] for issue in issues if issue["severity"] == 0}
        assert named - {"SH_DEGREE_0_COEF_0"} == names


def test_three_js_reads_splats_and_without_its_plugin_points(exported, run_node):
    count = len(read_glb_splats(exported / "terrain.glb"))
    (kind, unit, _), (fallback, _, attributes) = json.loads(run_node(THREE, exported / "terrain.glb"))
    assert (kind, unit, fallback) == ("GaussianSplat", "metre", "Points")
    assert attributes["position"] == attributes["color"] == count


@pytest.mark.parametrize("version", spz.VERSIONS)
def test_the_reference_decoder_of_spz_sees_the_same_picture(exported, node_modules, tmp_path, version):
    from dav_gswt.export.spool import Spool

    field = read_field(exported / "terrain.ply")
    with Spool(tmp_path / "spool") as placed:
        placed.append(turn_field(field, Y_DOWN.T))
    spz.write_spz(placed, tmp_path / "a.spz", version)
    convert(node_modules, tmp_path / "a.spz", tmp_path / "b.ply")
    read = read_field(tmp_path / "b.ply")
    assert len(read) == len(field)
    wanted, seen = (take_picture(f, Y_DOWN.T) for f in (field, read))
    assert psnr(seen, wanted, np.ones((SIZE, SIZE))) > (38 if version == 3 else 34)


def test_splat_transform_makes_the_same_of_our_ply_as_we_do(exported, node_modules, tmp_path):
    """Its own GLB of our PLY, against our GLB: the same Gaussians with the same up, by half a turn about it."""
    convert(node_modules, exported / "terrain.ply", tmp_path / "theirs.glb")
    ours, theirs = (read_glb_splats(path) for path in (exported / "terrain.glb", tmp_path / "theirs.glb"))
    wanted, seen = take_picture(ours, Y_UP.T), take_picture(theirs, Y_UP.T @ np.diag([-1.0, 1.0, -1.0]))
    decibels = psnr(seen, wanted, np.ones((SIZE, SIZE)))
    assert len(ours) == len(theirs) and (decibels is None or decibels > 60)


def convert(node_modules, source, target):
    command = ["node", node_modules / "@playcanvas/splat-transform/bin/cli.mjs", "-q", "-w", source, target]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr


def test_trimesh_reads_the_points(exported):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    scene = trimesh.load(exported / "terrain.glb")
    (cloud,) = scene.geometry.values()
    assert len(cloud.vertices) == len(read_glb_splats(exported / "terrain.glb"))


def test_gsply_reads_the_ply(exported):
    pytest.importorskip("gsply", reason="gsply is not installed")
    code = "import sys, gsply; print(len(gsply.plyread(sys.argv[1]).means))"
    done = subprocess.run([sys.executable, "-c", code, exported / "terrain.ply"], capture_output=True, text=True)
    assert done.returncode == 0 and int(done.stdout) == len(read_field(exported / "terrain.ply")), done.stderr


@pytest.fixture(scope="module")
def ground(cover_bundle, hills, export_settings, tmp_path_factory):
    """The ground of the same cells, of a scene that is known on earth."""
    from fixtures.land_covers import cover_content

    from dav_gswt.export import ground_files
    from dav_gswt.geometry.georeference import Georeference
    from dav_gswt.terrain import endless

    out = tmp_path_factory.mktemp("ground") / "out"
    terrain = endless.terrain_from_bundle(cover_bundle, hills)
    settings = export_settings | {"columns": 6, "rows": 5, "centre": [3.0, 1.5]}
    place = Georeference(47.1, 11.3, 600.0, 20.0, metres_per_unit=1.0)
    ground_files.export_ground(terrain, cover_bundle.manifest, cover_content().tiles, place, settings, out)
    return out


@pytest.mark.parametrize("name", ["ground", "objects"])
def test_gltf_validator_finds_nothing_in_meshes(ground, run_node, name):
    assert json.loads(run_node(VALIDATE, ground / f"{name}.glb"))["issues"]["messages"] == []


def test_trimesh_reads_a_node_an_object(ground):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    scene = trimesh.load(ground / "objects.glb")
    assert len(scene.geometry) == json.loads((ground / "ground.json").read_text())["objects"]
    assert all(mesh.is_watertight and mesh.is_convex for mesh in scene.geometry.values())


def test_mujoco_loads_the_model_and_its_rays_meet_the_heights(ground):
    mujoco = pytest.importorskip("mujoco", reason="mujoco is not installed")
    model = mujoco.MjModel.from_xml_path(str(ground / "ground.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tiff, known = read_heights(ground)
    rng, hit = np.random.default_rng(2), np.zeros(1, np.int32)
    for row, column in rng.integers([1, 1], [known["rows"] - 1, known["columns"] - 1], (200, 2)):
        x, y = known["north_west"][0] + column * known["step"], known["north_west"][1] - row * known["step"]
        away = mujoco.mj_ray(model, data, np.array([x + 1e-4, y - 1e-4, 20]), np.array([0, 0, -1.0]), None, 1, -1, hit)
        name = model.geom(hit[0]).name
        assert name != "ground" or abs(20 - away - tiff[row, column]) < 2e-3
        assert name == "ground" or 20 - away > tiff[row, column] - 0.1  # an object stands there


def read_heights(ground):
    import tifffile

    return tifffile.imread(ground / "ground.tif"), json.loads((ground / "ground.json").read_text())["heights"]


def test_rasterio_knows_where_on_earth_the_heights_lie(ground):
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    from pyproj import Transformer

    tiff, known = read_heights(ground)
    origin = json.loads((ground / "ground.json").read_text())["origin"]
    with rasterio.open(ground / "ground.tif") as image:
        assert image.crs.to_epsg() == 32632 and image.scales == (1.0,) and image.offsets == (600.0,)
        np.testing.assert_array_equal(image.read(1), tiff)
        found = np.array([image.xy(row, column) for row, column in ((0, 0), (10, 30))])
    east, north = np.radians(110.0), np.radians(20.0)  # the azimuths of the world's x and y
    places = []
    for row, column in ((0, 0), (10, 30)):
        x = known["north_west"][0] + column * known["step"] + origin[0]
        y = known["north_west"][1] - row * known["step"] + origin[1]
        places.append([x * np.sin(east) + y * np.sin(north), x * np.cos(east) + y * np.cos(north)])
    zero = Transformer.from_crs("EPSG:4326", "EPSG:32632", always_xy=True).transform(11.3, 47.1)
    grid = np.radians((11.3 - 9) * np.sin(np.radians(47.1)))  # convergence of the meridians
    turn = np.array([[np.cos(grid), -np.sin(grid)], [np.sin(grid), np.cos(grid)]])
    np.testing.assert_allclose(found, zero + np.array(places) @ turn.T, atol=0.02)
