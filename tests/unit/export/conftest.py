"""A bundle of two materials with objects, on hills, and the programs of others that npm brings."""

import json
import shutil
import subprocess

import pytest
from fixtures.land_covers import write_cover_bundle
from fixtures.random_field import random_field

from dav_gswt.bundle import store
from dav_gswt.config.settings import Export
from dav_gswt.export import spool, terrain_files
from dav_gswt.export.spool import Spool
from dav_gswt.terrain import endless

HILLS = {"kind": "hills", "height": 0.4, "wavelength": 4}
NPM = ["gltf-validator@2.0.0-dev.3.10", "three@0.187.0", "@playcanvas/splat-transform@2.7.1"]


@pytest.fixture
def field(monkeypatch):
    monkeypatch.setattr(spool, "CHUNK", 64)  # several parts
    return random_field(200, seed=1)


@pytest.fixture
def placed(field, tmp_path):
    with Spool(tmp_path / "spool") as placed:
        placed.append(field)
    return placed


@pytest.fixture(scope="session")
def cover_bundle(tmp_path_factory, root):
    folder = tmp_path_factory.mktemp("cover") / "b"
    write_cover_bundle(folder)
    return store.read_bundle(folder)


@pytest.fixture(scope="session")
def export_settings():
    """The config's `export`, all keys."""
    settings = Export(columns=3, rows=2, centre=[0.0, 0.0])
    return settings.model_dump(mode="json", exclude_none=True)


@pytest.fixture(scope="session")
def cover_terrain(cover_bundle):
    return endless.terrain_from_bundle(cover_bundle, HILLS)


@pytest.fixture
def export(cover_bundle, cover_terrain, export_settings, tmp_path):
    """A function that exports the terrain to tmp_path / name; what terrain.json says."""

    def export(name="out", threads=1, reference=None, **changes):
        settings, out = export_settings | changes, tmp_path / name
        terrain_files.export_terrain(cover_terrain, cover_bundle.manifest, settings, out, threads, reference)
        return json.loads((out / "terrain.json").read_text())

    return export


@pytest.fixture(scope="session")
def node_modules(tmp_path_factory):
    """A folder with the programs of NPM below node_modules/."""
    if shutil.which("npm") is None:
        pytest.skip("npm is not here")
    folder = tmp_path_factory.mktemp("npm")
    command = ["npm", "install", "--prefix", folder, "--no-audit", "--no-fund", "--ignore-scripts", *NPM]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    except subprocess.TimeoutExpired:
        pytest.skip("npm cannot be reached")
    if done.returncode:
        pytest.skip(f"npm cannot fetch {', '.join(NPM)}: {done.stderr.strip()[-100:]}")
    return folder / "node_modules"


@pytest.fixture(scope="session")
def run_node(node_modules):
    """Run a module of JavaScript beside node_modules/; what it prints."""

    def run(source: str, *arguments) -> str:
        script = node_modules.parent / "script.mjs"
        script.write_text(source, encoding="utf-8")
        done = subprocess.run(["node", script, *arguments], capture_output=True, text=True, check=False, timeout=300)
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    return run
