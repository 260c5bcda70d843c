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
    likeness = psnr(seen, wanted, np.ones((SIZE, SIZE)))
    assert len(ours) == len(theirs) and (likeness is None or likeness > 60)


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
