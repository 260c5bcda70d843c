"""Tiles that are composed of exemplars and recipes: to the byte, once, and nothing of what makes no sense."""

import hashlib
import json
from base64 import b64decode, b64encode

import numpy as np
import pytest
from fixtures.compositions import CELL, LEVELS, SIDE, Composed, split
from fixtures.dropped_files import drop, zipped

MADE = Composed()
OPEN = """
  const { openSource, readManifest, readParts } = await import("./data/bundle.js");
  const { PageError } = await import("./data/checks.js");
  const { createComposer } = await import("./data/compose.js");
  const { run } = await import("./terrain/draw_order.js");
  const blob = new Blob([Uint8Array.from(atob(text), c => c.charCodeAt(0))]), source = await openSource(blob);
  const list = words => Array.from(new Uint8Array(words.buffer, words.byteOffset, words.byteLength));
"""
COMPOSE = """async ({ text, chunks }) => {
  OPEN
  try {
    const manifest = await readManifest(source), composer = createComposer(manifest);
    await readParts(manifest, source, { take: (index, buffer) => run(composer.add(index, buffer)) });
    return chunks.map(([tile, level]) => list(run(composer.compose(tile, level))));
  } catch (error) {
    if (error instanceof PageError) return error.message;
    throw error;
  }
}""".replace("OPEN", OPEN)
CHUNKS = [(tile, level) for tile in (0, 7, 15, 16, 31) for level in range(LEVELS + 1)]


def compose(modules, files: dict[str, bytes], chunks=CHUNKS):
    """The records of chunks, or what the page says against the bundle."""
    return modules.evaluate(COMPOSE, {"text": b64encode(zipped(files)).decode(), "chunks": chunks})


def test_chunks_are_those_of_the_specification_to_the_byte(modules):
    found = compose(modules, MADE.files())
    assert [bytes(one) for one in found] == [MADE.records(*chunk) for chunk in CHUNKS]
    assert len({bytes(one) for one in found}) == len(CHUNKS) and min(map(len, found)) > 0


def test_chunks_are_those_of_the_golden_file(modules, root):
    golden = json.loads((root / "tests/golden/composition.json").read_text())
    files = {name: b64decode(text) for name, text in golden["files"].items()}
    chunks = [(tile, level) for tile in range(len(golden["chunks"])) for level in range(len(golden["chunks"][0]))]
    found = iter(compose(modules, files, chunks))
    for levels in golden["chunks"]:
        assert [hashlib.sha256(bytes(next(found))).hexdigest() for _ in levels] == levels


def test_parts_of_kinds_that_come_later_are_left_aside(modules):
    later = {"kind": "variation", "amount": 3}
    assert isinstance(compose(modules, MADE.files(lambda m: m["parts"].insert(1, later))), list)


RECIPES, FINEST = MADE.parts["recipes"], MADE.parts["level0"]
RECIPE = 36 + 9 * SIDE**2  # bytes


def recipes_with(at: int, data: bytes) -> bytes:
    """All recipes, with some bytes of the recipe of tile 3 replaced."""
    at += 3 * RECIPE
    return RECIPES[:at] + data + RECIPES[at + len(data) :]


def swap(manifest):
    first, second = [part for part in manifest["parts"] if part["kind"] == "level"]
    for key in ("file", "bytes", "size", "sha256"):
        first[key], second[key] = second[key], first[key]


def count_more(manifest):
    manifest["tiles"][4]["chunks"][0]["count"] += 1


def promise(name: str, **values):
    def edit(manifest):
        next(part for part in manifest["parts"] if part["file"] == f"parts/{name}.bin").update(values)

    return edit


def half_a_step(manifest):
    manifest["encoding"]["origin"][0] -= 0.5 * manifest["encoding"]["step"][0]


def bomb(manifest):
    """The finest level unpacks to more than it says; what it has is the digest of that."""
    part = next(part for part in manifest["parts"] if part["file"] == "parts/level0.bin")
    part["size"] = part["bytes"]


@pytest.mark.parametrize(
    "files, words",
    [
        pytest.param(MADE.files(recipes=recipes_with(36, b"\t")), "a label is out of range", id="label"),
        pytest.param(
            MADE.files(recipes=recipes_with(0, np.full(18, 4, "<i2").tobytes())),
            "tile 3 shows what is not",
            id="beyond",
        ),
        pytest.param(
            MADE.files(recipes=recipes_with(0, np.full(18, -2, "<i2").tobytes())), "tile 3 shows what is", id="before"
        ),
        pytest.param(
            MADE.files(recipes=recipes_with(0, np.full(18, 1, "<i2").tobytes())), "tile 3 shows what is", id="between"
        ),
        pytest.param(MADE.files(count_more), "tile 4 has", id="count"),
        pytest.param(MADE.files(recipes=RECIPES[:-1]), "it holds other than a recipe a tile", id="short recipes"),
        pytest.param(MADE.files(recipes=RECIPES + b"\0"), "it holds other than a recipe a tile", id="long recipes"),
        pytest.param(MADE.files(level0=FINEST[:-1]), "level0.bin makes no sense: it is cut short", id="short level"),
        pytest.param(MADE.files(level0=FINEST + b"\0"), "level0.bin makes no sense: it is too long", id="long level"),
        pytest.param(MADE.files(level0=split([9]) * 10), "level0.bin makes no sense: it is cut short", id="no level"),
        pytest.param(MADE.files(swap), "makes no sense: it is", id="swapped levels"),
        pytest.param(MADE.files(promise("level1", level=0)), "“composition” is missing or makes", id="same level"),
        pytest.param(MADE.files(promise("recipes", kind="later")), "“composition” is", id="no recipes"),
        pytest.param(MADE.files(bomb), "level0.bin is larger than was promised where it is unpacked", id="bomb"),
        pytest.param(MADE.files(promise("level0", size=len(FINEST) + 1)), "level0.bin is cut short", id="cut"),
        pytest.param(MADE.files(promise("level0", size=2**30)), "“parts” is missing or makes", id="size"),
        pytest.param(MADE.files(promise("level0", sha256="0" * 64)), "level0.bin is damaged", id="digest"),
        pytest.param(MADE.files(promise("level0", file="parts/../x.bin")), "“parts” is missing", id="path"),
        pytest.param(MADE.files(promise("coarse", size=19 * 32 * 5 - 19)), "contradicts itself", id="few records"),
        pytest.param(MADE.files(lambda m: m["composition"].update(cell=CELL + 1)), "“composition”", id="cell"),
        pytest.param(MADE.files(lambda m: m["composition"].update(side=3)), "“composition”", id="odd side"),
        pytest.param(MADE.files(lambda m: m["composition"].update(exemplars=[7])), "“composition”", id="one exemplar"),
        pytest.param(MADE.files(lambda m: m["encoding"].update(origin=[0.1, 0, 0])), "“composition”", id="origin"),
        pytest.param(MADE.files(half_a_step), "“composition”", id="half a step"),
        pytest.param(MADE.files(lambda m: m["composition"].update(exemplars=[7, 5000])), "“composition”", id="cells"),
        pytest.param(MADE.files(promise("level0", bytes=10**6)), "“parts” is missing", id="more bytes than it holds"),
        pytest.param(MADE.files(lambda m: m["parts"][1].pop("sha256")), "“parts” is missing", id="no digest"),
        pytest.param(MADE.files(lambda m: m["parts"].append(dict(m["parts"][0]))), "“parts” is missing", id="twice"),
        pytest.param(MADE.files(lambda m: m.pop("composition")), "“composition”", id="none"),
        pytest.param(MADE.files(lambda m: m["tiles"][2].pop("orders")), "the orders of tile 2", id="no orders"),
        pytest.param(MADE.files(lambda m: m.update(version=3)), "bundle of version 3", id="older"),
    ],
)
def test_a_hostile_bundle_is_refused_with_what_is_wrong(modules, files, words):
    message = compose(modules, files)
    assert isinstance(message, str) and words in message


def test_a_splat_outside_of_its_cell_is_refused(modules):
    """It would end up in another tile, or beyond 65535 in another place altogether."""
    level = bytearray(FINEST)
    cells = np.frombuffer(FINEST[:98], np.uint8).reshape(2, 49)
    at = 98 + int(cells[0].sum())
    level[at] = 255  # high byte of the first x
    assert "a splat lies outside of its cell" in compose(modules, MADE.files(level0=bytes(level)))


def test_counts_beyond_32_bits_are_refused(modules):
    """65537 cells of 65535 splats and one of 1 are 2^32 splats, not none."""
    counts = np.zeros(257**2, np.uint16)
    counts[:65537], counts[65537] = 65535, 1

    def edit(manifest):
        manifest["composition"].update(exemplars=[257, 257])
        manifest["parts"].insert(1, manifest["parts"].pop())

    files = MADE.files(edit, level0=6 * split(counts.tolist()))
    assert "level0.bin makes no sense: it is cut short" in compose(modules, files)


def test_what_is_not_zlib_is_refused(modules):
    junk = MADE.files()["parts/level0.bin"][::-1]
    files = MADE.files(promise("level0", sha256=hashlib.sha256(junk).hexdigest()))
    assert "level0.bin is damaged where it is unpacked" in compose(modules, files | {"parts/level0.bin": junk})


def test_colours_and_heights_are_clamped(modules):
    """The made-up exemplars go beyond the ends, or this test would show nothing."""
    records = np.frombuffer(MADE.records(0, 0), np.uint8).reshape(-1, 16)
    colours, heights = records[:, 12:15], records[:, 4:6].copy().view("<u2")
    assert {0, 255} <= set(colours.ravel()) and {0, 65535} <= set(heights.ravel())


def test_a_bundle_of_recipes_is_drawn_and_a_hostile_one_is_told(target):
    opened = target.page.evaluate("davgswt.state.opened")
    drop(target, "bundle.zip", zipped(MADE.files()))
    target.until(f"davgswt.state.opened === {opened + 1}")
    picture = target.at(x=2.0, y=2.0, eye=1.5, yaw=30.0, pitch=-40.0)
    state = target.state
    assert picture.std() > 5 and state["drawn"][-1]["level"] == 0
    drop(target, "bundle.zip", zipped(MADE.files(count_more)))
    alert = target.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert "tile 4 has" in alert.inner_text()
    assert not target.state["loaded"]
    alert.click()
