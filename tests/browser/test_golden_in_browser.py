"""The page's modules compute the numbers of the golden files, as the library's do."""

import json
from pathlib import Path

import numpy as np
from fixtures.shader_functions import OPEN_SHADER

from dav_gswt.terrain import planet

FOLDER = Path(__file__).parents[1] / "golden"

WEIGHTS = (
    "async ({ levels, opacities }) => {"
    + OPEN_SHADER
    + """
  const { CROSSFADE, LEVEL_WEIGHTS } = await import("./draw/shaders.js");
  const vertex = `#version 300 es
    ${LEVEL_WEIGHTS} ${CROSSFADE}
    uniform float x, y;
    out vec4 found;
    void main() {
      found = levels > 0 ? vec4(levelWeight(0, x), levelWeight(1, x), levelWeight(2, x), levelWeight(3, x))
        : vec4(crossfadeOpacity(x, y));
    }`;
  const { gl, at, run: runShader } = openShader(vertex);
  const padded = (list) => Float32Array.from({ length: 8 }, (_, k) => list[k] ?? 0);
  const run = (count, x, y, { switches = [], bands = [] } = {}) => {
    gl.uniform1i(at("levels"), count);
    gl.uniform1f(at("x"), x);
    gl.uniform1f(at("y"), y);
    gl.uniform1fv(at("switches[0]"), padded(switches));
    gl.uniform1fv(at("bands[0]"), padded(bands));
    return runShader();
  };
  return [levels.map(l => run(l.switches.length, l.distance, 0, l).slice(0, l.switches.length)),
    opacities.map(o => run(0, o.opacity, o.weight)[0])];
}"""
)


def golden(name):
    return json.loads((FOLDER / f"{name}.json").read_text())


def test_tiles_and_hashes_are_the_integers_shared_with_the_library(modules):
    cells = golden("tile_choice")["cells"]
    computed = modules.evaluate(
        """async cells => {
          const { hashCell, tileAt } = await import("./terrain/choice.js");
          return cells.map(({ i, j, salt, variants }) => ({ i, j, salt, variants,
            hashes: [0, 1, 2].map(axis => hashCell(i, j, axis, salt)), tile: tileAt(i, j, salt, variants) }));
        }""",
        cells,
    )
    assert computed == cells


def test_surfaces_have_the_heights_slopes_and_bounds_shared_with_the_library(modules):
    surfaces = golden("heights")["surfaces"]
    computed = modules.evaluate(
        """async surfaces => {
          const { createHeights } = await import("./terrain/heights.js");
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


def test_the_place_has_the_variation_shared_with_the_library(modules):
    varied = golden("heights")["variation"]
    computed = modules.evaluate(
        """async ({ waves, side, salt, points }) => {
          const { createVariation } = await import("./terrain/variation.js");
          const { at } = createVariation({ variation: waves, tile_side: side, salt });
          return points.map(({ x, y, material }) => at(x, y, material));
        }""",
        varied,
    )
    np.testing.assert_allclose(computed, [point["change"] for point in varied["points"]], rtol=0, atol=1e-12)


def test_levels_have_the_weights_shared_with_the_library(modules):
    values = golden("weights")
    sharp = [entry for entry in values["levels"] if not entry["smooth"]]  # the page has no smooth fades
    levels, opacities = modules.evaluate(WEIGHTS, {"levels": sharp, "opacities": values["opacities"]})
    for entry, found in zip(sharp, levels, strict=True):
        # float32: a distance's last digit over the width of the band
        slack = [6e-8 * entry["distance"] / band for band in entry["bands"][:-1] if band]
        np.testing.assert_allclose(found, entry["weights"], atol=1e-6 + max(slack, default=0))
    # float32 keeps 1 - 0.999999 to a sixteenth; a step of an 8-bit colour is 4e-3
    np.testing.assert_allclose(opacities, [o["drawn"] for o in values["opacities"]], atol=2e-4)


def test_cells_and_orders_stand_as_they_do_in_the_library(modules):
    values = golden("draw_order")
    cells, orders = modules.evaluate(
        """async ({ cells, along, orders }) => {
          const { inNearBlock, nearestOrder, visitBackToFront } = await import("./terrain/draw_order.js");
          const listed = cells.map(({ eye: [i0, j0], west, south, columns, rows }) => {
            const order = [], close = [];
            visitBackToFront(20, (di, dj) => {
              const i = i0 + di, j = j0 + dj;
              if (i < west || j < south || i >= west + columns || j >= south + rows) return;
              order.push([i, j]);
              close.push(inNearBlock(di, dj));
            });
            return { order, close };
          });
          return [listed, orders.map(({ kept, to, slope }) => nearestOrder(along, kept, to, ...slope))];
        }""",
        values,
    )
    assert cells == [{"order": entry["order"], "close": entry["close"]} for entry in values["cells"]]
    assert orders == [entry["position"] for entry in values["orders"]]


def test_classes_have_the_scores_and_keep_the_gaussians_shared_with_the_library(modules):
    terrains = golden("classes")["terrains"]
    computed = modules.evaluate(
        """async terrains => {
          const { createClasses } = await import("./terrain/classes.js");
          const { createHeights } = await import("./terrain/heights.js");
          return terrains.map(({ side, materials, classes, heights, cells }) => {
            const made = createClasses(classes, materials, side, createHeights(heights));
            return cells.map(({ i, j, places }) => {
              const corner = new Float64Array(materials);
              made.latticeScores(8 * i, 8 * j, corner, 0);
              return { materials: made.materialsIn(i, j), corner: [...corner], places: places.map(p => ({
                scores: [...made.scoresAt(i, j, p.x / side, p.y / side)],
                jitter: [...made.jitterAt(i, j, p.x / side, p.y / side)],
                kept: made.keep(i, j, { centres: new Float32Array([p.x, p.y, p.z]), count: 1 }, p.material).length > 0,
              })) };
            });
          });
        }""",
        terrains,
    )
    for terrain, cells in zip(terrains, computed, strict=True):
        for expected, found in zip(terrain["cells"], cells, strict=True):
            assert found["materials"] == expected["materials"]
            np.testing.assert_allclose(found["corner"], expected["corner"], rtol=0, atol=1e-12)
            for place, own in zip(expected["places"], found["places"], strict=True):
                assert own["kept"] == place["kept"]
                for name in ("scores", "jitter"):
                    np.testing.assert_allclose(own[name], place[name], rtol=0, atol=1e-12)


def test_objects_stand_where_they_do_in_the_library(modules):
    terrains = golden("scatter")["terrains"]
    computed = modules.evaluate(
        """async terrains => {
          const { createClasses } = await import("./terrain/classes.js");
          const { createHeights } = await import("./terrain/heights.js");
          const { createScatter } = await import("./terrain/scatter.js");
          return terrains.map(({ side, materials, classes, scatter, objects, cells }) => {
            const cover = classes && createClasses(classes, materials, side, createHeights());
            const made = createScatter(scatter, objects, side, cover);
            return cells.map(({ i, j }) => [...made.instancesIn(i, j)].sort((a, b) => a.v - b.v || a.u - b.u));
          });
        }""",
        terrains,
    )
    for terrain, cells in zip(terrains, computed, strict=True):
        for expected, found in zip(terrain["cells"], cells, strict=True):
            assert [one["number"] for one in found] == [one["object"] for one in expected["instances"]]
            for name in ("u", "v", "turn", "size"):
                values = [[one[name] for one in ones] for ones in (found, expected["instances"])]
                np.testing.assert_allclose(*values, rtol=0, atol=1e-12)


def test_spheres_bend_tiles_choose_them_and_fray_as_in_the_library(modules):
    spheres = golden("sphere")["spheres"]
    computed = modules.evaluate(
        """async spheres => {
          const { bend, rateOf, tangentAt } = await import("./terrain/sphere.js");
          const { createFraying, isCovered, isFrayed, tileOn } = await import("./terrain/sphere_edges.js");
          return spheres.map(({ radius, side, cells, salt, variants, bends, tiles, kept }) => {
            const sphere = { cells }, fraying = createFraying(sphere, side, salt);
            return {
              bends: bends.map(({ i, j, local: [x, y, z] }) => (
                bend(x, y, z, tangentAt(i + 0.5, cells), tangentAt(j + 0.5, cells), radius, rateOf(sphere, side), []))),
              tiles: tiles.map(({ face, i, j }) => [
                tileOn(sphere, face, i, j, salt, variants), isCovered(sphere, face, i, j),
                isFrayed(sphere, face, i, j)]),
              kept: kept.map(({ face, place }) => fraying.stays(face, ...place)),
            };
          });
        }""",
        spheres,
    )
    for entry, found in zip(spheres, computed, strict=True):
        for expected, bent in zip(entry["bends"], found["bends"], strict=True):
            np.testing.assert_allclose(bent[:3], expected["point"], atol=1e-9)
            np.testing.assert_allclose(np.reshape(bent[3:], (3, 3)).T, expected["jacobian"], atol=1e-12)
        assert found["tiles"] == [[one["tile"], one["covered"], one["frayed"]] for one in entry["tiles"]]
        assert found["kept"] == [one["stays"] for one in entry["kept"]]


def test_cells_of_a_sphere_stand_as_they_do_in_the_library(modules):
    values = golden("sphere")["orders"]
    views = modules.evaluate(
        """async ({ cells, views }) => {
          const { aimFaces, compareCells, isClose } = await import("./terrain/sphere_cells.js");
          return views.map(({ eye, order }) => {
            const own = aimFaces({ cells }, eye), all = order.map(([face, i, j]) => ({ face, i, j }));
            all.sort((a, b) => a.face - b.face || a.i - b.i || a.j - b.j);
            all.sort((a, b) => compareCells(own, a, b));
            return { eye, order: all.map(({ face, i, j }) => [face, i, j]), close: all.map(
              ({ face, i, j }) => isClose(own[face], i, j)) };
          });
        }""",
        values,
    )
    assert views == values["views"]


def test_a_walk_over_a_planet_is_that_of_the_library(modules):
    rng, walks = np.random.default_rng(4), []
    for _ in range(40):
        longitude, yaw = rng.uniform(-180, 180, 2).tolist()
        latitude, (east, north) = float(rng.uniform(-90, 90)), rng.normal(size=2).tolist()
        walks.append([{"x": longitude, "y": latitude, "yaw": yaw}, east, north])
    walks.append([{"x": 33.0, "y": 90.0, "yaw": 20.0}, 0.5, -0.25])
    found = modules.evaluate(
        """async walks => {
          const { frameAt, walkOn } = await import("./terrain/sphere.js");
          return walks.map(([place, east, north]) => {
            const there = walkOn(place, east, north, 1.5);
            return { ...there, frame: frameAt(there.x, there.y) };
          });
        }""",
        walks,
    )
    for (place, east, north), there in zip(walks, found, strict=True):
        frame = planet.walk_from(planet.frame_at(place["x"], place["y"]), np.array([east, north]), 1.5)
        np.testing.assert_allclose(there["frame"][2], frame[2], atol=1e-12)
        looks = [
            np.cos(np.radians(yaw)) * axes[0] + np.sin(np.radians(yaw)) * axes[1]
            for yaw, axes in ((there["yaw"], np.array(there["frame"])), (place["yaw"], frame))
        ]
        np.testing.assert_allclose(*looks, atol=1e-12)
