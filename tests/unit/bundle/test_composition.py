"""Bundles of exemplars and recipes: the bytes that every reader composes, the tiles that they were made of, refusals."""

import base64
import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures import compositions
from fixtures.compositions import COMPOSED, NAME, RECIPE, TILES, compose_slowly, write_composition

from dav_gswt.bundle import manifest, store
from dav_gswt.bundle.blocks import unpack_block
from dav_gswt.bundle.parts import read_part
from dav_gswt.bundle.recipes import coarsen_correction
from dav_gswt.errors import InputError
from dav_gswt.tiles.compose import coarsen_labels

GOLDEN = Path(__file__).parents[2] / "golden" / "composition.json"


@pytest.fixture(scope="module")
def parts():
    return compositions.make_parts()


@pytest.fixture(scope="module")
def made(parts, tmp_path_factory):
    folder = tmp_path_factory.mktemp("composition") / "b"
    write_composition(folder, parts)
    return store.read_bundle(folder)


def test_tiles_are_composed_as_by_hand(made, parts):
    for tile in range(TILES):
        for level in range(COMPOSED):
            rows, _ = made.compose_tile(tile, level)
            assert rows.tobytes() == compose_slowly(parts, tile, level), (tile, level)


def test_the_made_up_bundle_has_the_extremes_it_is_meant_to_have(made):
    rows = np.concatenate([made.compose_tile(tile, 0)[0] for tile in range(TILES)])
    for values, most in ((rows["position"][:, 2], 65535), (rows["rgba"], 255)):
        assert all(0.01 < (values == end).mean() < 0.5 for end in (0, most))


def digest_chunks(bundle) -> dict[str, list[list[str]]]:
    """[number][level] of tiles and of objects: SHA-256 of the records of each chunk."""

    def digest(tile: int | None, chunk) -> str:
        if chunk.part is None:
            rows = bundle.compose_tile(tile, chunk.level)[0]
        else:
            block = unpack_block(read_part(bundle.folder, bundle.manifest.parts[chunk.part]))
            rows = block[chunk.first : chunk.first + chunk.count].to_records()
        return hashlib.sha256(rows.tobytes()).hexdigest()

    entries = {"tiles": bundle.manifest.tiles, "objects": bundle.manifest.objects}
    return {
        name: [[digest(number, chunk) for chunk in entry.chunks] for number, entry in enumerate(own)]
        for name, own in entries.items()
    }


def test_chunks_have_the_bytes_shared_with_the_page(made, tmp_path):
    """Of the bundle in the golden file, whose files are base64. With WRITE_GOLDEN=1 the file is written instead."""
    if os.environ.get("WRITE_GOLDEN"):
        value = {"manifest": json.loads((made.folder / NAME).read_text())}
        files = [part.file for part in made.manifest.parts]
        value |= {"files": {file: base64.b64encode((made.folder / file).read_bytes()).decode() for file in files}}
        rows = ",\n".join(f" {json.dumps(key)}: {json.dumps(own)}" for key, own in (value | digest_chunks(made)).items())
        GOLDEN.write_text(f"{{\n{rows}\n}}\n", encoding="utf-8")
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    (tmp_path / "parts").mkdir()
    for file, data in golden["files"].items():
        (tmp_path / file).write_bytes(base64.b64decode(data))
    (tmp_path / NAME).write_text(json.dumps(golden["manifest"]))
    found = digest_chunks(store.read_bundle(tmp_path))
    assert found == {key: golden[key] for key in ("tiles", "objects")} == digest_chunks(made)


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
def opened(parts, made, tmp_path):
    """Writes the bundle with changed parts, and all else in agreement; it is opened."""

    def write(change=None, **changes):
        found = {name: changes[name](data) if name in changes else data for name, data in parts.items()}
        counts = [[chunk.count for chunk in tile.chunks[:COMPOSED]] for tile in made.manifest.tiles]
        write_composition(tmp_path / "b", found, change, counts)
        return store.read_bundle(tmp_path / "b")

    return write


LABELS = 36  # bytes of a recipe before its labels


def one_label(tile: int, label: int, shift: tuple[int, int] = (0, 0)):
    """A tile that shows one patch alone, whose shift is given."""

    def change(data: bytes) -> bytes:
        data = changed(data, tile * RECIPE + LABELS, bytes([label]) * compositions.SIDE**2)
        return changed(data, tile * RECIPE + 4 * min(label, 8), np.array(shift, "<i2").tobytes())

    return change


@pytest.mark.parametrize(
    "changes, message",
    [
        pytest.param({"recipes": lambda d: changed(d, LABELS, b"\x09")}, "recipes.bin: tile 0 has an unknown", id="label"),
        pytest.param({"recipes": one_label(17, 255)}, "recipes.bin: tile 17 has an unknown", id="labels"),
        pytest.param({"recipes": one_label(0, 3, (6, 0))}, "tile 0 shows ground beyond its exemplar", id="too far east"),
        pytest.param({"recipes": one_label(0, 3, (0, -2))}, "tile 0 shows ground beyond its exemplar", id="south"),
        pytest.param({"recipes": one_label(0, 8, (-32768, 32766))}, "tile 0 shows ground beyond", id="farthest"),
        pytest.param({"recipes": one_label(16, 3, (4, 0))}, "tile 16 shows ground beyond", id="of another material"),
        pytest.param({"recipes": one_label(0, 3, (1, 0))}, "recipes.bin: tile 0 ", id="between coarse cells"),
        pytest.param({"level0": lambda d: d[:-1]}, "level0.bin: ends too early", id="short by a byte"),
        pytest.param({"level0": lambda d: d[:1]}, "level0.bin: ends too early", id="of one byte"),
        pytest.param({"level0": lambda d: d[:128]}, "level0.bin: ends too early", id="of counts alone"),
        pytest.param({"level0": lambda d: d + b"\0"}, "level0.bin: goes on after its end", id="longer by a byte"),
        pytest.param({"level0": lambda d: changed(d, 64, b"\xff")}, "level0.bin: ends too early", id="many in a cell"),
    ],
)
def test_what_parts_say_is_checked(opened, changes, message):
    read = opened(**changes)
    with pytest.raises(InputError, match=message) as refusal:
        for tile in range(TILES):
            read.chunk(tile, 0)
    assert "\n" not in str(refusal.value)


def test_a_tile_must_have_as_many_splats_as_the_manifest_says(opened):
    read = opened(change=lambda m: m["tiles"][5]["chunks"][1].update(count=1))
    assert len(read.chunk(5, 0)) == read.manifest.tiles[5].chunks[0].count
    with pytest.raises(InputError, match=r"level1.bin: tile 5 has \d+ splats, not 1; make the bundle again"):
        read.chunk(5, 1)


def swap(value, first, second):
    """The files of two parts, with sizes and digests, in each other's place."""
    a, b = (next(part for part in value["parts"] if name in part["file"]) for name in (first, second))
    kept = {key: a[key] for key in ("file", "bytes", "size", "sha256")}
    a.update({key: b[key] for key in kept})
    b.update(kept)


def test_levels_in_each_others_place_are_refused(opened):
    read = opened(change=lambda m: swap(m, "level0", "level1"))
    for level, message in ((0, "level1.bin: ends too early"), (1, "level0.bin: ")):
        with pytest.raises(InputError, match=message):
            read.chunk(0, level)


def test_parts_of_kinds_to_come_are_left_alone(opened):
    def add(value):
        value["parts"].insert(0, value["parts"][0] | {"kind": "later", "file": "parts/later.bin"})
        for entry in (*value["tiles"], *value["objects"]):
            for chunk in entry["chunks"]:
                if "part" in chunk:
                    chunk["part"] += 1

    read = opened(change=add)
    assert len(read.chunk(31, 2)) == 32 and len(read.chunk(31, 0)) and len(read.object_chunk(0, 2)) == 1


def of_kind(value, kind):
    return next(part for part in value["parts"] if part["kind"] == kind)


@pytest.mark.parametrize(
    "message, change",
    [
        ("level 0 is neither composed nor stored", lambda m: m.pop("composition")),
        ("level 0 is neither composed nor stored", lambda m: m["tiles"][3]["chunks"][0].update(part=0, first=0)),
        ("level 2 is neither composed nor stored", lambda m: m["tiles"][3]["chunks"][2].pop("part")),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(count=33)),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(part=1)),
        ("the records of level 2 are not there", lambda m: m["tiles"][31]["chunks"][2].update(part=99)),
        ("object 0: the records of level 2 are not there", lambda m: m["objects"][0]["chunks"][2].update(first=3)),
        ("levels do not fit the tiles", lambda m: m["composition"].update(side=5)),
        ("levels do not fit the tiles", lambda m: m["composition"].update(levels=4)),
        ("one of each composed level is needed", lambda m: m["composition"].update(levels=1)),
        ("one of each composed level is needed", lambda m: of_kind(m, "level").update(level=0)),
        ("one of each composed level is needed", lambda m: of_kind(m, "level").update(kind="later")),
        ("recipes or exemplars are missing", lambda m: of_kind(m, "recipes").update(kind="later")),
        ("recipes or exemplars are missing", lambda m: m["composition"].update(exemplars=[8])),
        ("size does not fit the tiles", lambda m: of_kind(m, "recipes").update(size=1)),
        ("size does not fit the tiles", lambda m: swap(m, "recipes", "level0")),
        ("a cell is not a whole number of steps", lambda m: m["composition"].update(cell=255)),
        ("a tile does not fit the grid", lambda m: m["encoding"].update(origin=[1.0, 0, 0])),
        ("a tile does not fit the grid", lambda m: m["encoding"].update(origin=[0, -63.5, 0])),
        ("exemplars", lambda m: m["composition"].update(exemplars=[8, 1 << 20])),
    ],
)
def test_a_manifest_whose_composition_contradicts_itself_is_refused(made, message, change):
    value = made.manifest.to_dict()
    change(value)
    with pytest.raises(InputError, match=message):
        manifest.Manifest.from_dict(value)
