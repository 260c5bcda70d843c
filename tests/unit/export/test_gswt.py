"""The tile set for the public renderer and as PLY files, with objects baked into tiles."""

import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from fixtures import tile_sets
from fixtures.land_covers import SIDE, TILES, cover_content, shrub

from dav_gswt.bundle import build, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.export import gswt
from dav_gswt.field import read_field


def first(thing):
    """The object on the first material."""
    return replace(thing, material=0)


@pytest.fixture(scope="module")
def content():
    return replace(cover_content(), objects=[first(shrub(0.4, 0.2))])


def bake(content, objects):
    return gswt.bake_objects(content.tiles[0].fields, objects, content.ground_height(0), SIDE, 7)


@pytest.fixture(scope="module")
def baked(content):
    return bake(content, content.objects)


def test_tiles_keep_the_same_mean_height_and_their_borders(content, baked):
    """The public renderer shifts each tile by its own mean height."""
    heights = [float(field.means[:, 2].astype(float).mean()) for field in baked[0]]
    assert np.ptp(heights) < 1e-5 * SIDE
    for before, after in zip(content.tiles[0].fields[0], baked[0], strict=True):
        edge = np.abs(before.means[:, :2] - SIDE / 2).max(1) > 0.49 * SIDE
        np.testing.assert_allclose(after.means[: len(before)][edge], before.means[edge], atol=2e-4)
        middle = after.means[len(before) :, :2]
        assert len(middle) == 0 or np.abs(middle - SIDE / 2).max() <= 0.46 * SIDE


def test_the_public_renderers_checker_finds_no_fault_with_objects(content, gswt_checker, tmp_path):
    fields = bake(content, [first(shrub(0.4, 0.2)), first(shrub(0.2, 0.5))])
    gswt.write_gswt(fields, SIDE, tmp_path / "objects.zip")
    assert_no_faults(gswt_checker, tmp_path / "objects.zip")


def assert_no_faults(checker, path):
    done = subprocess.run([sys.executable, checker, path], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and " 0 faults" in done.stdout, done.stdout + done.stderr


@pytest.fixture(scope="module")
def composed(tmp_path_factory):
    """A bundle of which three levels are composed and one is stored."""
    folder = tmp_path_factory.mktemp("bundle") / "b"
    tiles = BundleContent.of_one_material(tile_sets.tiles_of(tile_sets.exemplar(), levels=4))
    build.write_bundle(tiles, folder, build.BundleOptions(tau=0.5, salt=7), {})
    return store.read_bundle(folder)


@pytest.fixture(scope="module")
def archive(composed, tmp_path_factory):
    path = tmp_path_factory.mktemp("archive") / "gswt.zip"
    gswt.export_archive(composed, path)
    return path


def test_the_public_renderers_checker_finds_no_fault_with_composed_tiles(archive, gswt_checker):
    assert_no_faults(gswt_checker, archive)


def test_an_archive_has_every_splat_of_a_composed_bundle_and_the_same_bytes_each_time(composed, archive, tmp_path):
    with zipfile.ZipFile(archive) as opened:
        assert opened.namelist() == [f"lod{level}_tile_{t:02d}.ply" for level in range(4) for t in range(16)]
        for level, tile in ((0, 3), (2, 15), (3, 0)):
            body = opened.read(f"lod{level}_tile_{tile:02d}.ply").split(b"end_header\n", 1)[1]
            values, source = np.frombuffer(body, "<f4").reshape(-1, 62), composed.chunk(tile, level)
            scale = gswt.TILE_WIDTH / composed.manifest.tile_side
            np.testing.assert_allclose(values[:, :2], scale * source.means[:, :2], atol=1e-6)  # float32 up to 4
    gswt.export_archive(composed, tmp_path / "again.zip")
    assert (tmp_path / "again.zip").read_bytes() == archive.read_bytes()


def test_the_objects_of_a_bundle_are_baked_into_its_first_material(cover_bundle, tmp_path):
    stone = replace(cover_bundle.manifest.objects[0], material=0)
    bundle = replace(cover_bundle, manifest=replace(cover_bundle.manifest, objects=[stone]))
    for name, each in (("with.zip", bundle), ("without.zip", cover_bundle)):
        gswt.export_archive(each, tmp_path / name)
    sizes = [sum(e.file_size for e in zipfile.ZipFile(tmp_path / f).infolist()) for f in ("with.zip", "without.zip")]
    assert len(zipfile.ZipFile(tmp_path / "with.zip").namelist()) == 2 * TILES and sizes[0] > sizes[1]


def test_tiles_as_files_are_those_of_the_bundle(composed, tmp_path):
    gswt.export_tiles(composed, tmp_path / "tiles")
    assert len(list((tmp_path / "tiles").glob("*.ply"))) == 4 * 16
    for level in range(4):
        read, wanted = read_field(tmp_path / f"tiles/lod{level}_tile_05.ply"), composed.chunk(5, level)
        np.testing.assert_array_equal(read.means, wanted.means)
        np.testing.assert_array_equal(read.ground, wanted.ground)
