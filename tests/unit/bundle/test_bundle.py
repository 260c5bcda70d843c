"""Bundles of stored records: values by hand, round trips, refusals."""

import hashlib
import json
import shutil
import zlib

import numpy as np
import pytest
from fixtures.tile_sets import report_of

from dav_gswt.bundle import build, manifest, store
from dav_gswt.bundle.content import BundleContent
from dav_gswt.bundle.parts import read_part, unpack_block
from dav_gswt.bundle.recipes import coarsen_rotation
from dav_gswt.errors import InputError
from dav_gswt.field import GaussianField, rgb_to_sh
from dav_gswt.tiles.build import TileSet

SIDE = 2.0
PART = "parts/records0.bin"
one = BundleContent.of_one_material


def random_field(n, sigma, seed):
    rng = np.random.default_rng(seed)
    return GaussianField(
        (rng.random((n, 3)) * [SIDE, SIDE, 0.2]).astype(np.float32),
        np.log(sigma * rng.uniform(0.5, 1.5, (n, 3))).astype(np.float32),
        rng.normal(size=(n, 4)).astype(np.float32),
        rng.normal(size=n).astype(np.float32),
        rgb_to_sh(rng.random((n, 3)).astype(np.float32)),
        np.zeros(n, np.float32),
        np.ones(n, bool),
    )


@pytest.fixture(scope="module")
def tiles():
    fields = [[random_field(60 >> level, 0.02 * 2**level, 100 * level + t) for t in range(16)] for level in range(2)]
    uncertainty = np.linspace(0, 1, 16)
    return TileSet(
        SIDE, 0.1, fields, np.zeros((16, 20, 20), np.uint8), np.zeros((16, 9, 2), int), uncertainty, report_of()
    )


@pytest.fixture(scope="module")
def bundle(tiles, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "b"
    options = build.BundleOptions(tau=0.5, salt=7)
    return folder, build.write_bundle(one(tiles), folder, options, {"from": "a test"})


def test_a_level_ends_where_the_next_one_has_its_size_in_pixels():
    # f = 960 / tan 30 degrees = 1662.77 px: 0.3 units cover 2 px at 249.4 units
    table = manifest.compute_levels([0.1, 0.3], pixels=2.0, band=0.1)
    assert table[0].distance == pytest.approx(249.415, abs=1e-3)
    assert table[0].band == pytest.approx(24.9415, abs=1e-4)
    assert table[1].distance is None
    # a scene in other units is the same scene
    assert manifest.compute_levels([1.0, 3.0], 2.0, 0.1)[0].distance == pytest.approx(10 * table[0].distance)
    with pytest.raises(InputError, match="level 1"):
        manifest.compute_levels([0.1, 0.1], 1.0, 0.1)


def test_eye_floor_shows_the_nearest_disc_at_the_size_asked_for():
    height = manifest.compute_eye_floor(spacing=0.01, pixels=8.0)
    v = np.arctan(9 / 16 * np.tan(np.radians(30)))  # half of the picture's height
    ray = height / np.sin(np.radians(30) + v)  # to the ground at the picture's lower edge
    assert 0.01 * 1662.768775 / (ray * np.cos(v)) == pytest.approx(8.0)
    assert (
        manifest.compute_eye_floor(0.02, 8.0)
        == pytest.approx(2 * height)
        == pytest.approx(manifest.compute_eye_floor(0.01, 4.0))
    )


def test_a_bundle_reads_back_as_the_tiles_it_was_made_of(bundle, tiles):
    folder, written = bundle
    read = store.read_bundle(folder)
    assert read.manifest == written
    for number, tile in enumerate(read.manifest.tiles):
        for entry in tile.chunks:
            source = tiles.fields[entry.level][number]
            field, rows = read.chunk(number, entry.level), written.encoding.encode(source)
            rows["rotation"] = coarsen_rotation(rows["rotation"])
            data = read_part(folder, written.parts[entry.part])
            stored = unpack_block(data)[entry.first : entry.first + entry.count].to_records()
            assert stored.tobytes() == rows.tobytes()
            # half a step of 2 / 65535 along x and y, of 0.2 / 65535 along z
            away = np.linalg.norm(field.means.astype(float) - source.means, axis=1).max()
            assert 0 < away <= np.hypot(np.hypot(1, 1), 0.1) / 65535 * 1.001
            assert np.abs(field.base_colours - source.base_colours).max() <= 0.5 / 255 + 1e-6
            assert field.means[:, 2].min() >= tile.z[0] and field.means[:, 2].max() <= tile.z[1]
    every = len(written.directions)
    uncertain = {len(tile.orders) for tile in written.tiles if tile.uncertainty >= 0.5}
    plain = {len(tile.orders) for tile in written.tiles if tile.uncertainty < 0.5}
    assert uncertain == {every} and plain == {(every + 1) // 2}


def test_a_tile_without_splats_is_refused_and_nothing_is_left(tiles, tmp_path):
    fields = [list(level) for level in tiles.fields]
    fields[0][3] = fields[0][3][:0]
    broken = TileSet(**{**vars(tiles), "fields": fields})
    with pytest.raises(InputError, match="a tile has no splat"):
        build.write_bundle(one(broken), tmp_path / "b", build.BundleOptions(tau=0.5), {})
    assert not (tmp_path / "b").exists() and not (tmp_path / ".b.part").exists()


@pytest.fixture
def copy_of(bundle, tmp_path):
    """The bundle in a folder of its own, to be spoilt."""
    shutil.copytree(bundle[0], tmp_path / "copy")
    return tmp_path / "copy"


def rewritten(folder, change):
    value = json.loads((folder / manifest.NAME).read_text())
    change(value)
    (folder / manifest.NAME).write_text(json.dumps(value))


def replaced(folder, data):
    """Another file for the last part, with its size and digest in the manifest."""
    (folder / PART).write_bytes(data)
    told = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    rewritten(folder, lambda m: m["parts"][-1].update(told))


def inflated(folder):
    return zlib.decompress((folder / PART).read_bytes())


def bomb(folder):
    """A part that inflates to a thousand times what the manifest says."""
    replaced(folder, zlib.compress(bytes(1000 * len(inflated(folder)))))


def in_pieces(folder):
    """A part of as many bytes as the manifest says, of which the last splat is not whole."""
    replaced(folder, zlib.compress(inflated(folder)[:-1]))
    rewritten(folder, lambda m: m["parts"][-1].update(size=m["parts"][-1]["size"] - 1))
    rewritten(folder, lambda m: m["tiles"][15]["chunks"][0].update(count=1))


def linked(path):
    """The part as a link to a file outside of the bundle."""
    outside = path.rename(path.parents[2] / "elsewhere.bin")
    path.symlink_to(outside)


def cut(path, end, more=b""):
    path.write_bytes(path.read_bytes()[:end] + more)


@pytest.mark.parametrize(
    "spoil, message",
    [
        pytest.param(lambda f: cut(f / PART, -4), "records0.bin: .* bytes where the manifest says", id="cut short"),
        pytest.param(lambda f: cut(f / PART, -4, b"else"), "records0.bin: its digest is not", id="altered"),
        pytest.param(lambda f: replaced(f, b"else"), r"records0.bin: not readable \(Error -3", id="not compressed"),
        pytest.param(bomb, "records0.bin: does not hold .* bytes", id="inflates beyond its size"),
        pytest.param(
            lambda f: replaced(f, zlib.compress(inflated(f)[:-19])), "records0.bin: does not hold .* bytes", id="short"
        ),
        pytest.param(
            lambda f: replaced(f, zlib.compress(inflated(f))[:-9]), "records0.bin: does not hold .* bytes", id="ends"
        ),
        pytest.param(
            lambda f: replaced(f, zlib.compress(inflated(f)) + b"x"), "records0.bin: does not hold .* bytes", id="more"
        ),
        pytest.param(in_pieces, "records0.bin: does not hold whole splats", id="in pieces"),
        pytest.param(lambda f: (f / PART).unlink(), "records0.bin: not readable", id="missing"),
        pytest.param(lambda f: linked(f / PART), "records0.bin: lies outside of the folder", id="a link outwards"),
        pytest.param(lambda f: rewritten(f, lambda m: m.update(version=3)), "version 4; make", id="another version"),
        pytest.param(lambda f: rewritten(f, lambda m: m.update(format="x")), "format 'davgswt'", id="another format"),
        pytest.param(lambda f: (f / "davgswt.json").write_text("{"), "not readable as JSON", id="no JSON"),
        pytest.param(lambda f: (f / "davgswt.json").write_text("[]"), "format 'davgswt'", id="no manifest"),
    ],
)
def test_a_spoilt_bundle_is_refused_by_name(copy_of, spoil, message):
    spoil(copy_of)
    with pytest.raises(InputError, match=message):
        store.read_bundle(copy_of).chunk(0, 0)


def test_a_manifest_as_large_as_no_manifest_is_not_read(copy_of, monkeypatch):
    monkeypatch.setattr(manifest, "MAX_BYTES", 1000)
    with pytest.raises(InputError, match="bytes are no manifest"):
        store.read_bundle(copy_of)


@pytest.mark.parametrize(
    "key, change",
    [
        ("tile_side", lambda m: m.update(tile_side=-1)),
        ("a length is beyond", lambda m: m.update(eye_floor=2e9)),
        ("mean_scale", lambda m: m["levels"][1].update(mean_scale=1e-9)),
        ("levels must count up", lambda m: m["levels"][0].update(level=1)),
        ("distances", lambda m: m["levels"][0].update(distance=None)),
        ("16 C", lambda m: m["tiles"].append(m["tiles"][0])),
        ("file", lambda m: m["parts"][0].update(file="../secret.bin")),
        ("a file is there twice", lambda m: m["parts"].append(m["parts"][0])),
        ("size", lambda m: m["parts"][0].update(size=2**40)),
        ("the records of level 0 are not there", lambda m: m["tiles"][15]["chunks"][0].update(count=61)),
        ("the records of level 0 are not there", lambda m: m["tiles"][0]["chunks"][0].update(first=2**60)),
        ("the records of level 0 are not there", lambda m: m["tiles"][0]["chunks"][0].update(part=2)),
        ("the records of level 1 are not there", lambda m: m["parts"][0].update(kind="later")),
        ("level 0 is neither composed nor stored", lambda m: m["tiles"][0]["chunks"][0].pop("first")),
        ("one chunk a level", lambda m: m["tiles"][0]["chunks"].reverse()),
        ("an order is there twice", lambda m: m["tiles"][0]["orders"].append(0)),
        ("orders", lambda m: m["tiles"][0].update(orders=[])),
        ("direction", lambda m: m["directions"].pop()),
        ("log_scale makes no sense", lambda m: m["encoding"].update(log_scale=[59.0, 0.01])),
    ],
)
def test_a_manifest_that_contradicts_itself_or_its_schema_is_refused(bundle, key, change):
    value = bundle[1].to_dict()
    change(value)
    with pytest.raises(InputError, match=f"(?i){key}"):
        manifest.Manifest.from_dict(value)


def test_the_schema_describes_every_key():
    schema = json.loads(manifest.make_schema())
    entries = {"Manifest": schema} | schema["$defs"]
    keys = {f"{name}.{key}": about for name, entry in entries.items() for key, about in entry["properties"].items()}
    assert not [key for key, about in keys.items() if not about.get("description")]
    assert keys["LevelEntry.band"]["description"].startswith("Half the length over which")
    assert not [name for name, entry in entries.items() if "Attributes:" in entry["description"]]
