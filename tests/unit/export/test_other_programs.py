"""What is written, read by programs that others wrote. Each test is skipped where its program cannot be had."""

import json
import subprocess

import numpy as np
import pytest
from fixtures.land_covers import cover_content
from fixtures.splat_files import read_glb_splats

from dav_gswt.export import ground_files, splat_files, terrain_files
from dav_gswt.export.axes import Y_DOWN, turn_field
from dav_gswt.export.spool import Spool
from dav_gswt.field import read_field
from dav_gswt.geometry import cameras
from dav_gswt.images.metrics import psnr
from dav_gswt.raster import render

pytestmark = pytest.mark.slow
SIZE = 128
VALIDATE = """
import fs from 'fs';
import validator from 'gltf-validator';
const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])));
console.log(JSON.stringify(report.issues.messages));
"""
THREE = """
import fs from 'fs';
globalThis.self = globalThis;
const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
const { GLTFGaussianSplatLoaderExtension } = await import('three/addons/loaders/GLTFGaussianSplatLoaderExtension.js');
const bytes = fs.readFileSync(process.argv[2]);
for (const splats of [true, false]) {
  const loader = new GLTFLoader();
  if (splats) loader.register((parser) => new GLTFGaussianSplatLoaderExtension(parser));
  const gltf = await loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength), '');
  gltf.scene.traverse((object) => {
    if (object.geometry) console.log(object.constructor.name, object.geometry.attributes.position?.count);
  });
}
"""


@pytest.fixture(scope="module")
def exported(cover_bundle, cover_terrain, export_settings, tmp_path_factory):
    """A finite terrain in the formats that need no other program, and its ground."""
    out, manifest, tiles = tmp_path_factory.mktemp("terrain") / "out", cover_bundle.manifest, cover_content().tiles
    terrain_files.export_terrain(cover_terrain, manifest, export_settings | {"formats": ["ply", "glb"]}, out)
    settings = export_settings | {"columns": 6, "rows": 5, "centre": [3.0, 1.5]}  # with objects
    ground_files.export_ground(cover_terrain, manifest, tiles, settings, out / "ground")
    return out


@pytest.mark.parametrize("name", ["ground", "objects"])
def test_gltf_validator_finds_nothing_in_meshes(exported, run_node, name):
    assert json.loads(run_node(VALIDATE, exported / f"ground/{name}.glb")) == []


def test_three_js_reads_splats_and_without_its_plugin_points(exported, run_node):
    splats, points = run_node(THREE, exported / "terrain.glb").splitlines()
    assert splats.startswith("GaussianSplat ")
    assert points == f"Points {len(read_glb_splats(exported / 'terrain.glb'))}"


@pytest.mark.parametrize("version", [2, 3])
def test_the_reference_decoder_of_spz_sees_the_same_picture(exported, node_modules, tmp_path, version):
    field = read_field(exported / "terrain.ply")
    with Spool(tmp_path / "spool") as placed:
        placed.append(turn_field(field, Y_DOWN.T))
    splat_files.write_spz(placed, tmp_path / "a.spz", version)
    program = node_modules / "@playcanvas/splat-transform/bin/cli.mjs"
    command = ["node", program, "-q", "-w", tmp_path / "a.spz", tmp_path / "b.ply"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    read = read_field(tmp_path / "b.ply")
    assert len(read) == len(field)
    camera = cameras.pinhole(np.array([4.0, -9.0, 5.0]), np.zeros(3), SIZE, SIZE, 50.0)
    wanted, seen = (render(turn_field(f, Y_DOWN.T), camera, 0.5).colour for f in (field, read))
    assert psnr(seen, wanted, np.ones((SIZE, SIZE))) > (38 if version == 3 else 34)
