"""Bundles of exemplars and recipes: the bytes that every reader composes, and refusals."""

import base64
import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest
from fixtures.compositions import CELL, EXEMPLARS, LEVELS, SIDE, Composed

from dav_gswt.bundle import manifest, store
from dav_gswt.bundle.parts import read_part, unpack_block
from dav_gswt.bundle.recipes import coarsen_correction
from dav_gswt.errors import InputError
from dav_gswt.tiles.compose import coarsen_labels

GOLDEN = Path(__file__).parents[2] / "golden" / "composition.json"


TILES, RECIPE, LABELS = 16 * len(EXEMPLARS), 36 + 9 * SIDE**2, 36  # bytes of a recipe, and before its labels


def write_files(files: dict[str, bytes], folder: Path):
    """A bundle of these files."""
    (folder / "parts").mkdir(parents=True)
    for name, data in files.items():
        (folder / name).write_bytes(data)
    return store.read_bundle(folder)


@pytest.fixture(scope="module")
def composed():
    return Composed()


@pytest.fixture(scope="module")
def made(composed, tmp_path_factory):
    return write_files(composed.files(), tmp_path_factory.mktemp("composition") / "b")


def read_records(bundle, tile: int, level: int):
    """The records of a chunk, composed or stored."""
    chunk = bundle.manifest.tiles[tile].chunks[level]
    if chunk.part is None:
        return bundle.compose_tile(tile, level)[0]
    block = unpack_block(read_part(bundle.folder, bundle.manifest.parts[chunk.part]))
    return block[chunk.first : chunk.first + chunk.count].to_records()


def test_chunks_have_the_bytes_of_a_slow_reader(made, composed):
    for tile in range(TILES):
        for level in range(LEVELS + 1):
            assert read_records(made, tile, level).tobytes() == composed.records(tile, level), (tile, level)


def test_chunks_have_the_bytes_shared_with_the_page(made, composed, tmp_path):
    """Of the bundle in the golden file: its files as base64, SHA-256 of the records of [tile][level].

    With WRITE_GOLDEN=1 in the environment the file is written instead.
    """

    def digest(bundle) -> list[list[str]]:
        rows = [[read_records(bundle, tile, level) for level in range(LEVELS + 1)] for tile in range(TILES)]
        return [[hashlib.sha256(each.tobytes()).hexdigest() for each in levels] for levels in rows]

    if os.environ.get("WRITE_GOLDEN"):
        files = {name: base64.b64encode(data).decode() for name, data in composed.files().items()}
        rows = ",\n".join(f" {json.dumps(key)}: {json.dumps(value)}" for key, value in files.items())
        chunks = ",\n".join(f" {json.dumps(levels)}" for levels in digest(made))
        GOLDEN.write_text(f'{{"files": {{\n{rows}}},\n"chunks": [\n{chunks}]}}\n', encoding="utf-8")
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    read = write_files({name: base64.b64decode(data) for name, data in golden["files"].items()}, tmp_path / "b")
    assert digest(read) == golden["chunks"]


def test_a_correction_on_coarser_cells_is_the_mean_under_their_label_halves_up():
    labels = np.array([[1, 1, 0, 2], [1, 3, 2, 0]] * 2, np.uint8)
    coarse = coarsen_labels(labels, 2)
    assert coarse.tolist() == [[1, 0], [1, 0]]
    height = np.array([[-1, -2, 7, 99], [0, 99, 99, 8], [-1, -3, -7, 99], [-1, 99, 99, -8]])
    correction = np.zeros((4, 4, 4), np.int16)
    correction[0], correction[1:] = height, -height
    found = coarsen_correction(correction, labels, coarse)
    # (-1 - 2 + 0) / 3; (7 + 8) / 2; (-1 - 3 - 1) / 3 = -1.67; (-7 - 8) / 2 = -7.5
    assert found[0].tolist() == [[-1, 8], [-2, -7]]
    assert found[1:].tolist() == [[[1, -7], [2, 8]]] * 3
    wide = np.full((4, 4, 4), -(1 << 15), np.int16)
    assert (coarsen_correction(wide, labels, coarse) == -(1 << 15)).all(), "sums do not overflow"


def changed(data: bytes, at: int, by: bytes) -> bytes:
    return data[:at] + by + data[at + len(by) :]


@pytest.fixture
def opened(composed, tmp_path):
    """Writes the bundle with changed parts or another manifest, and all else in agreement; it is opened."""

    def write(change=None, **changes):
        parts = {name: of(composed.parts[name]) for name, of in changes.items()}
        return write_files(composed.files(change, **parts), tmp_path / "b")

    return write


def one_label(tile: int, label: int, shift: tuple[int, int] = (0, 0)):
    """A tile that shows one patch alone, whose shift is given."""

    def change(data: bytes) -> bytes:
        data = changed(data, tile * RECIPE + LABELS, bytes([label]) * SIDE**2)
        return changed(data, tile * RECIPE + 4 * min(label, 8), np.array(shift, "<i2").tobytes())

    return change


def first_x(x: int):
    """The first splat of the finest level at another x."""
    at = 2 * EXEMPLARS[0] ** 2

    def change(data: bytes) -> bytes:
        count = sum(data[: at // 2])
        return changed(changed(data, at, bytes([x & 255])), at + count, bytes([x >> 8]))

    return change


@pytest.mark.parametrize(
    "changes, message",
    [
        pytest.param(
            {"recipes": lambda d: changed(d, LABELS, b"\x09")}, "recipes.bin: tile 0 has an unknown", id="label"
        ),
        pytest.param({"recipes": one_label(17, 255)}, "recipes.bin: tile 17 has an unknown", id="labels"),
        pytest.param(
            {"recipes": one_label(0, 3, (6, 0))}, "tile 0 shows ground beyond its exemplar", id="too far east"
        ),
        pytest.param({"recipes": one_label(0, 3, (0, -2))}, "tile 0 shows ground beyond its exemplar", id="south"),
        pytest.param({"recipes": one_label(0, 8, (-32768, 32766))}, "tile 0 shows ground beyond", id="farthest"),
        pytest.param({"recipes": one_label(16, 3, (4, 0))}, "tile 16 shows ground beyond", id="of another material"),
        pytest.param({"recipes": one_label(0, 3, (1, 0))}, "recipes.bin: tile 0 ", id="between coarse cells"),
        pytest.param({"level0": lambda d: d[:-1]}, "level0.bin: ends too early", id="short by a byte"),
        pytest.param({"level0": lambda d: d[:1]}, "level0.bin: ends too early", id="of one byte"),
        pytest.param({"level0": lambda d: d[:98]}, "level0.bin: ends too early", id="of counts alone"),
        pytest.param({"level0": lambda d: d + b"\0"}, "level0.bin: goes on after its end", id="longer by a byte"),
        pytest.param({"level0": lambda d: changed(d, 49, b"\xff")}, "level0.bin: ends too early", id="many in a cell"),
        pytest.param({"level0": first_x(CELL + 1)}, "level0.bin: a splat lies outside of its cell", id="out of a cell"),
    ],
)
def test_what_parts_say_is_checked(opened, changes, message):
    read = opened(**changes)
    with pytest.raises(InputError, match=message) as refusal:
        for tile in range(TILES):
            read.chunk(tile, 0)
    assert "\n" not in str(refusal.value)


def test_a_tile_of_more_splats_than_it_says_is_not_composed(opened, monkeypatch):
    """A cell of 65535 splats that every cell of a large tile shows takes a few bytes of a file, and all memory."""
    read = opened(change=lambda m: m["tiles"][0]["chunks"][0].update(count=1))
    monkeypatch.setattr(store.recipes, "compose_records", None)
    with pytest.raises(InputError, match="tile 0 has"):
        read.chunk(0, 0)


def swap(value, first, second):
    """The files of two parts, with sizes and digests, in each other's place."""
    a, b = (next(part for part in value["parts"] if name in part["file"]) for name in (first, second))
    kept = {key: a[key] for key in ("file", "bytes", "size", "sha256")}
    a.update({key: b[key] for key in kept})
    b.update(kept)


def test_parts_of_kinds_to_come_are_left_alone(opened):
    def add(value):
        value["parts"].append(value["parts"][0] | {"kind": "later", "file": "parts/later.bin"})

    read = opened(change=add)
    assert len(read.chunk(31, 2)) == 5 and len(read.chunk(31, 0))


def of_kind(value, kind):
    return next(part for part in value["parts"] if part["kind"] == kind)


def shift_origin(value, steps: float):
    value["encoding"]["origin"][0] -= steps * value["encoding"]["step"][0]


@pytest.mark.parametrize(
    "message, change",
    [
        ("level 0 is neither composed nor stored", lambda m: m.pop("composition")),
        ("level 0 is neither composed nor stored", lambda m: m["tiles"][3]["chunks"][0].update(part=0, first=0)),
        ("level 2 is neither composed nor stored", lambda m: m["tiles"][3]["chunks"][2].pop("part")),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(count=6)),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(part=1)),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(part=99)),
        ("levels do not fit the tiles", lambda m: m["composition"].update(side=SIDE + 1)),
        ("levels do not fit the tiles", lambda m: m["composition"].update(levels=4)),
        ("one of each composed level is needed", lambda m: m["composition"].update(levels=1)),
        ("one of each composed level is needed", lambda m: of_kind(m, "level").update(level=0)),
        ("only those", lambda m: of_kind(m, "level").update(kind="later")),
        ("recipes or exemplars are missing", lambda m: of_kind(m, "recipes").update(kind="later")),
        ("recipes or exemplars are missing", lambda m: m["composition"].update(exemplars=[8])),
        ("size does not fit the tiles", lambda m: of_kind(m, "recipes").update(size=1)),
        ("size does not fit the tiles", lambda m: swap(m, "recipes", "level0")),
        ("a cell is not a whole number of steps", lambda m: m["composition"].update(cell=CELL - 1)),
        ("a tile does not fit the grid", lambda m: m["encoding"].update(origin=[1.0, 0, 0])),
        ("a tile does not fit the grid", lambda m: m["encoding"].update(origin=[0, -23, 0])),
        ("count", lambda m: m["tiles"][0]["chunks"][0].update(count=(1 << 24) + 1)),
        ("exemplars", lambda m: m["composition"].update(exemplars=[8, 1 << 20])),
        ("do not|does not begin at a step", lambda m: shift_origin(m, 0.5)),
        ("only those", lambda m: m["parts"][1].update(level=3)),
        ("only those", lambda m: m["parts"].append(m["parts"][0] | {"kind": "level", "file": "parts/more.bin"})),
        ("size and bytes of a plain one", lambda m: m["parts"][0].update(kind="plain", size=2**20)),
        ("tile_side below", lambda m: m.update(tile_side=1e-300)),
        ("more than .* bytes", lambda m: m["parts"][0].update(size=2**29)),
        ("more than .* splats", lambda m: [t["chunks"][0].update(count=2**24) for t in m["tiles"]]),
        ("exemplars", lambda m: m["composition"].update(exemplars=[7, 5000])),
    ],
)
def test_a_manifest_whose_composition_contradicts_itself_is_refused(made, message, change):
    value = made.manifest.to_dict()
    change(value)
    with pytest.raises(InputError, match=message):
        manifest.Manifest.from_dict(value)


def test_a_manifest_that_is_no_file_or_a_part_that_leads_to_itself_is_refused(composed, tmp_path):
    made = write_files(composed.files(), tmp_path / "b")
    part = made.folder / "parts/level0.bin"
    part.unlink()
    part.symlink_to("level0.bin")
    with pytest.raises(InputError, match="level0.bin: not readable"):
        made.chunk(0, 0)
    (made.folder / manifest.NAME).unlink()
    (made.folder / manifest.NAME).symlink_to("/dev/zero")
    with pytest.raises(InputError, match="no file"):
        store.read_bundle(made.folder)
