"""Bundles: values by hand, round trips, refusals, and the public renderer's rules."""

import copy
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dav_gswt.bundle import build, chunks, gswt, lod, manifest, orders
from dav_gswt.errors import InputError
from dav_gswt.field import Field, sh_of
from dav_gswt.tiles.build import TileSet

SCHEMA = Path(__file__).parents[3] / "workflow/schemas/davgswt.schema.json"
SIDE = 2.0


def made_up(n, sigma, seed):
    rng = np.random.default_rng(seed)
    return Field(
        (rng.random((n, 3)) * [SIDE, SIDE, 0.2]).astype(np.float32),
        np.log(sigma * rng.uniform(0.5, 1.5, (n, 3))).astype(np.float32),
        rng.normal(size=(n, 4)).astype(np.float32),
        rng.normal(size=n).astype(np.float32),
        sh_of(rng.random((n, 3)).astype(np.float32)),
        np.zeros(n, np.float32),
        np.ones(n, bool),
    )


@pytest.fixture(scope="module")
def tiles():
    fields = [[made_up(60 >> level, 0.02 * 2**level, 100 * level + t) for t in range(16)] for level in range(2)]
    doubt = np.linspace(0, 1, 16)
    return TileSet(SIDE, 0.1, fields, np.zeros((16, 20, 20), np.uint8), np.zeros((16, 9, 2), int), doubt, {})


@pytest.fixture(scope="module")
def bundle(tiles, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bundle") / "b"
    return folder, build.write_bundle(tiles, folder, build.Options(tau=0.5, salt=7), SCHEMA, {"from": "a test"})


def test_a_splat_is_stored_as_its_32_bytes():
    field = Field(
        np.float32([[1, 2, 3]]),
        np.log(np.float32([[0.5, 0.25, 2]])),
        np.float32([[-2, 0, 0, 2]]),  # length 2.83, w < 0: stored as (0.707, 0, 0, -0.707)
        np.float32([0]),
        sh_of(np.float32([[1, 0.5, 0]])),
        np.float32([0]),
        np.array([True]),
    )
    expected = np.float32([1, 2, 3, 0.5, 0.25, 2]).astype("<f4").tobytes()
    # 255, 127.5 to even, 0, opacity 0.5 likewise; 128 +- 0.707 * 128 = 218.5, 37.5
    expected += bytes([255, 128, 0, 128]) + bytes([219, 128, 128, 37])
    assert chunks.records(field).tobytes() == expected


def test_directions_start_in_the_east_go_north_and_end_straight_down():
    found = orders.directions()
    down = np.radians(20)
    np.testing.assert_allclose(found[0], [np.cos(down), 0, -np.sin(down)], atol=1e-15)
    np.testing.assert_allclose(found[4], [0, np.cos(down), -np.sin(down)], atol=1e-15)
    np.testing.assert_allclose(found[-1], [0, 0, -1])
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, rtol=1e-15)


def test_order_runs_from_back_to_front_and_is_stable():
    means = np.float32([[0, 0, 0], [2, 0, 5], [1, 0, 0], [2, 9, 0]])
    # looking east the largest x is at the back; 1 and 3 are equally deep
    assert orders.back_to_front(means, np.array([1.0, 0, 0])).tolist() == [1, 3, 2, 0]
    assert orders.back_to_front(means, np.array([0, 0, -1.0])).tolist() == [0, 2, 3, 1]


def test_tau_zero_keeps_every_tile_deep_tau_one_none_and_it_never_rises():
    for u in (0.0, 0.3, 1.0):
        assert len(orders.kept(u, 0.0)) == 17 and len(orders.kept(u, 1.0)) == 9
        counts = [len(orders.kept(u, tau)) for tau in (0.0, 0.2, 0.3, 0.31, 0.9, 1.0)]
        assert counts == sorted(counts, reverse=True)
    assert orders.kept(0.1, 0.5) == [0, 2, 4, 6, 8, 10, 12, 14, 16]
    with pytest.raises(ValueError, match="uncertainty"):
        orders.kept(float("nan"), 0.5)


def test_a_level_ends_where_the_next_one_has_its_size_in_pixels():
    # f = 960 / tan 30 degrees = 1662.77 px: 0.3 units cover 2 px at 249.4 units
    table = lod.level_table([0.1, 0.3], pixels=2.0, band=0.1)
    assert table[0]["distance"] == pytest.approx(249.415, abs=1e-3)
    assert table[0]["band"] == pytest.approx(24.9415, abs=1e-4)
    assert table[1]["distance"] is None
    # a scene in other units is the same scene
    assert lod.level_table([1.0, 3.0], 2.0, 0.1)[0]["distance"] == pytest.approx(10 * table[0]["distance"])
    with pytest.raises(InputError, match="level 1"):
        lod.level_table([0.1, 0.1], 1.0, 0.1)


def test_eye_floor_shows_the_nearest_disc_at_the_size_asked_for():
    height = lod.eye_floor(spacing=0.01, pixels=8.0)
    v = np.arctan(9 / 16 * np.tan(np.radians(30)))  # half of the picture's height
    ray = height / np.sin(np.radians(30) + v)  # to the ground at the picture's lower edge
    assert 0.01 * 1662.768775 / (ray * np.cos(v)) == pytest.approx(8.0)
    assert lod.eye_floor(0.02, 8.0) == pytest.approx(2 * height) == pytest.approx(lod.eye_floor(0.01, 4.0))


def test_a_bundle_reads_back_as_the_tiles_it_was_made_of(bundle, tiles):
    folder, written = bundle
    value = manifest.read(folder, SCHEMA)
    assert value == json.loads(json.dumps(written))
    along = orders.directions()
    for tile in value["tiles"]:
        for entry in tile["chunks"]:
            source = tiles.fields[entry["level"]][tile["tile"]]
            field, order = chunks.read(folder, entry)
            np.testing.assert_array_equal(field.means, source.means)
            np.testing.assert_allclose(field.base_colours, source.base_colours, atol=0.5 / 255 + 1e-6)  # 8 bits
            turned = source.quats * np.where(source.quats[:, :1] < 0, -1, 1)
            turned /= np.linalg.norm(turned, axis=1, keepdims=True)
            # half a step of 1/128 while writing, 127 for 128 while reading: 0.5 / 128 + 1 / 127
            np.testing.assert_allclose(field.quats, turned, atol=0.012)
            assert field.means[:, 2].min() >= tile["z"][0] and field.means[:, 2].max() <= tile["z"][1]
            for direction, row in zip(entry["orders"], order, strict=True):
                depth = source.means[row].astype(float) @ along[direction]
                assert (np.diff(depth) <= 0).all()
        assert len(tile["chunks"][0]["orders"]) == (17 if tile["uncertainty"] >= 0.5 else 9)


def test_the_same_tiles_give_the_same_bytes(bundle, tiles, tmp_path):
    folder, _ = bundle
    build.write_bundle(tiles, tmp_path / "again", build.Options(tau=0.5, salt=7), SCHEMA, {"from": "a test"})
    names = sorted(p.relative_to(folder) for p in folder.rglob("*.*"))
    assert len(names) == 2 + 32
    for name in names:
        assert (folder / name).read_bytes() == (tmp_path / "again" / name).read_bytes(), name


def test_the_zip_holds_what_the_public_renderer_reads(bundle, tiles):
    folder, _ = bundle
    with zipfile.ZipFile(folder / "gswt.zip") as archive:
        assert archive.namelist() == [f"lod{level}_tile_{t:02d}.ply" for level in range(2) for t in range(16)]
        data = archive.read("lod1_tile_05.ply")
    header, body = data.split(b"end_header\n", 1)
    assert header.count(b"\n") == 65 and b"comment" not in header
    values = np.frombuffer(body, "<f4").reshape(-1, 62)
    source = tiles.fields[1][5]
    np.testing.assert_allclose(values[:, :3], 2 * source.means, rtol=1e-6)  # 2 wide to 4 wide, float32
    np.testing.assert_allclose(values[:, 55:58], source.log_scales + np.log(2), atol=1e-6)
    assert (values[:, 9:54] == 0).all() and (values[:, 3:6] == 0).all()


def test_a_tile_without_splats_is_refused_and_nothing_is_left(tiles, tmp_path):
    fields = [list(level) for level in tiles.fields]
    fields[0][3] = fields[0][3][:0]
    with pytest.raises(InputError, match="level 0, tile 3"):
        gswt.write(fields, SIDE, tmp_path / "gswt.zip")
    broken = TileSet(**{**vars(tiles), "fields": fields})
    with pytest.raises(InputError):
        build.write_bundle(broken, tmp_path / "b", build.Options(tau=0.5), SCHEMA, {})
    assert not (tmp_path / "b").exists() and not (tmp_path / ".b.part").exists()


def test_more_splats_than_the_renderer_takes_are_refused(tiles, tmp_path, monkeypatch):
    monkeypatch.setattr(gswt, "MOST", 100)
    with pytest.raises(InputError, match="the renderer takes 100"):
        gswt.write(tiles.fields, SIDE, tmp_path / "gswt.zip")


def test_a_new_bundle_replaces_the_old_one_and_leaves_its_neighbours(tiles, tmp_path):
    out = tmp_path / "b"
    (out / "chunks").mkdir(parents=True)
    (out / "chunks" / "stale.bin").write_bytes(b"x")
    (out / "terrain").mkdir()
    build.write_bundle(tiles, out, build.Options(tau=1.0), SCHEMA, {})
    assert sorted(p.name for p in out.iterdir()) == ["chunks", "davgswt.json", "gswt.zip", "terrain"]
    assert not (out / "chunks" / "stale.bin").exists()


@pytest.mark.parametrize("damage", [lambda d: d[:-4], lambda d: bytes([d[0] ^ 1]) + d[1:]], ids=["short", "flipped"])
def test_a_damaged_chunk_is_named(bundle, tmp_path, damage):
    folder, value = bundle
    entry = value["tiles"][0]["chunks"][0]
    (tmp_path / "chunks").mkdir()
    (tmp_path / entry["file"]).write_bytes(damage((folder / entry["file"]).read_bytes()))
    with pytest.raises(InputError, match="lod0_tile_00.bin"):
        chunks.read(tmp_path, entry)


@pytest.mark.parametrize(
    "key, change",
    [
        ("tile_side", lambda m: m.update(tile_side=-1)),
        ("unit", lambda m: m.update(unit=3)),
        ("additional", lambda m: m.update(colour="red")),
        ("distances", lambda m: m["levels"][0].update(distance=None)),
        ("16 C", lambda m: m["tiles"].append(m["tiles"][0])),
        ("file", lambda m: m["tiles"][0]["chunks"][0].update(file="../secret.bin")),
        ("bytes", lambda m: m["tiles"][0]["chunks"][0].update(count=5)),
        ("direction", lambda m: m["directions"].pop()),
    ],
)
def test_a_manifest_that_contradicts_itself_or_its_schema_is_refused(bundle, key, change):
    value = copy.deepcopy(bundle[1])
    change(value)
    with pytest.raises(InputError, match=f"(?i){key}"):
        manifest.check(value, SCHEMA)
