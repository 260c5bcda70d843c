"""The page's modules compute the numbers of the golden files, as the library's do."""

import json
from pathlib import Path

import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "golden"


@pytest.fixture
def page(visit, plain):
    return visit(160, 100).open(f"{plain}?still").page


def golden(name):
    return json.loads((FOLDER / f"{name}.json").read_text())


def test_surfaces_have_the_heights_slopes_and_bounds_shared_with_the_library(page):
    surfaces = golden("heights")["surfaces"]
    computed = page.evaluate(
        """async surfaces => {
          const { createHeights } = await import("./heights.js");
          return surfaces.map(s => {
            const shape = s.pixels && { rows: s.pixels.length, columns: s.pixels[0].length };
            const made = createHeights({ ...s, ...shape }, s.pixels && new Float32Array(s.pixels.flat()));
            return { bounds: [made.low, made.high, made.steepest], points: s.points.map(({ x, y }) => made.at(x, y)) };
          });
        }""",
        surfaces,
    )
    for surface, found in zip(surfaces, computed, strict=True):
        bounds = [surface[key] for key in ("low", "high", "steepest")]
        np.testing.assert_allclose(found["bounds"], bounds, rtol=1e-6, err_msg="a height map's are found in float32")
        expected = [[p["height"], *p["slope"]] for p in surface["points"]]
        np.testing.assert_allclose(found["points"], expected, rtol=1e-12, atol=1e-12)


def test_levels_have_the_weights_shared_with_the_library(page):
    values = golden("weights")
    levels, opacities = page.evaluate(
        """async ({ levels, opacities }) => {
          const { ofLevels, crossfaded } = await import("./weights.js");
          const finite = (list) => list.map(v => v ?? Infinity);
          return [levels.map(l => ofLevels(l.distance, finite(l.switches), l.bands, l.smooth)),
            opacities.map(o => crossfaded(o.opacity, o.weight))];
        }""",
        values,
    )
    for entry, found in zip(values["levels"], levels, strict=True):
        np.testing.assert_allclose(found, entry["weights"], atol=1e-15)
    np.testing.assert_allclose(opacities, [o["drawn"] for o in values["opacities"]], rtol=1e-14, atol=0)


def test_cells_and_orders_stand_as_they_do_in_the_library(page):
    values = golden("draw_order")
    cells, orders = page.evaluate(
        """async ({ cells, along, orders }) => {
          const { around, backToFront, nearest } = await import("./order.js");
          const listed = cells.map(({ eye: [i0, j0], west, south, columns, rows }) => {
            const order = [], close = [];
            backToFront(20, (di, dj) => {
              const i = i0 + di, j = j0 + dj;
              if (i < west || j < south || i >= west + columns || j >= south + rows) return;
              order.push([i, j]);
              close.push(around(di, dj));
            });
            return { order, close };
          });
          return [listed, orders.map(({ kept, to, slope }) => nearest(along, kept, to, ...slope))];
        }""",
        values,
    )
    assert cells == [{"order": entry["order"], "close": entry["close"]} for entry in values["cells"]]
    assert orders == [entry["position"] for entry in values["orders"]]


def test_sorting_is_exact_and_stable(page):
    depths = np.random.default_rng(3).normal(size=5000).astype(np.float32)
    depths[::7] = depths[3]
    depths[5], depths[6] = 0.0, 1e30
    found = page.evaluate(
        """async depths => {
          const { createSorter } = await import("./order.js");
          return [...createSorter()(new Float32Array(depths), depths.length)];
        }""",
        depths.tolist(),
    )
    assert found == np.argsort(-depths, kind="stable").tolist()
