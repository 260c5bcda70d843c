"""The page's tile choice computes the integers of the golden file, as the library's does."""

import json
from pathlib import Path

GOLDEN = json.loads((Path(__file__).parents[1] / "golden" / "tile_choice.json").read_text())["cells"]


def test_integers_are_those_shared_with_the_library(modules):
    computed = modules.evaluate(
        """async cells => {
          const { hashCell, tileAt } = await import("./terrain/choice.js");
          return cells.map(({ i, j, salt, variants }) => ({ i, j, salt, variants,
            hashes: [0, 1, 2].map(axis => hashCell(i, j, axis, salt)), tile: tileAt(i, j, salt, variants) }));
        }""",
        GOLDEN,
    )
    assert computed == GOLDEN
