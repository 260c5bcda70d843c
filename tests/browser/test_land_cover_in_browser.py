"""Terrains of two materials with objects: the page's pictures beside the library's, and what it does in a hurry."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fixtures.land_covers import SIDE, write_cover_bundle
from fixtures.page_visit import VIEWER, camera_at

from dav_gswt.bundle.manifest import Manifest
from dav_gswt.bundle.store import Bundle
from dav_gswt.study.terrain.browser import served
from dav_gswt.terrain import endless, stills, visibility
from dav_gswt.terrain.heights import FlatSurface, Hills
from dav_gswt.terrain.page import write_page

SCHEMA = Path(__file__).parents[2] / "workflow/schemas/davgswt.schema.json"
SURFACES = {"flat": FlatSurface(), "hills": Hills(1.5 * SIDE, 12.0 * SIDE, 3, 5)}
PLACES = {
    "walker": dict(x=3.0, y=5.0, eye=0.8, yaw=60.0, pitch=-12.0),
    "oblique": dict(x=-13.0, y=7.5, eye=3.0, yaw=200.0, pitch=-35.0),
    "above": dict(x=14.0, y=6.5, eye=8.0, yaw=77.0, pitch=-80.0),
    "far from the origin": dict(x=-40_003.0, y=25_001.0, eye=2.0, yaw=-30.0, pitch=-20.0),
}
MEAN, MOST = 1.0, 32  # of 255: mean and largest difference that is allowed
HURRY = """async place => {
  // frames of a place by a builder in a hurry, until they are complete, and the frame of one that is patient
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { listChunks } = await import("./data/layout.js");
  const manifest = await (await fetch("davgswt.json")).json(), heights = createHeights(manifest.heights);
  const camera = cameraAt(place, 640, 400, heights), real = performance.now.bind(performance);
  const chunks = await Promise.all(listChunks(manifest).map(async ({ tile, entry: { level, count, file } }) => (
    { tile, level, count, buffer: await (await fetch(file)).arrayBuffer() })));
  const fill = () => {
    const builder = createFrameBuilder(manifest, heights);
    for (const chunk of chunks) builder.add({ ...chunk, buffer: chunk.buffer.slice() });
    return builder;
  };
  const builder = fill(), frames = [], last = fill().build(camera, 1e6, true);
  let now = 0;
  performance.now = () => (now += 0.05); // a clock that leaves time for some dozens of batches
  do frames.push(builder.build(camera, 1e6, false)); while (frames.at(-1).incomplete && frames.length < 1000);
  performance.now = real;
  const describe = ({ blocks, near, cells }) => {
    let sum = 0; // of the entries that are drawn
    for (let k = 1; k < blocks.length; k += 4) sum += ((blocks[k] >>> 16) & 63) + 1;
    return { drawn: sum, near: near.length, cells: cells.length };
  };
  return { frames: frames.map(describe), patient: describe(last) };
}"""


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cover") / "bundle"
    write_cover_bundle(folder, SCHEMA)
    return folder


@pytest.fixture(scope="module", params=SURFACES)
def covered(request, bundle, tmp_path_factory):
    """The address of a page over a surface, and the library's terrain of the same bundle."""
    folder, surface = tmp_path_factory.mktemp("page") / "page", SURFACES[request.param]
    write_page(bundle, VIEWER, folder, surface)
    manifest = Manifest.from_dict(json.loads((folder / "davgswt.json").read_text()))
    terrain = endless.terrain_from_bundle(Bundle(folder, manifest), {"kind": "flat"})
    classes = replace(terrain.classes, heights=surface)
    scatter = replace(terrain.scatter, classes=classes)
    with served(folder) as address:
        yield address, replace(terrain, heights=surface, classes=classes, scatter=scatter), manifest


@pytest.mark.parametrize("place", [pytest.param(place, id=name) for name, place in PLACES.items()])
def test_the_page_draws_what_the_library_draws(still, covered, place):
    address, terrain, manifest = covered
    camera = camera_at(terrain, place)
    cells = visibility.visible_cells(terrain, camera)
    assert 3 in cells.materials and len(terrain.scatter.instances_in(cells.i, cells.j)) > 2
    drawn = still(address, 160, 100).at(**place)
    expected = np.rint(255 * stills.render_view(terrain, camera, manifest.sky, manifest.ground_colour))
    difference = np.abs(drawn - expected)
    assert difference.mean() < MEAN and difference.max() <= MOST


def test_a_hurried_frame_leaves_no_cell_out_and_is_soon_what_a_patient_one_is(still, covered):
    address, _, _ = covered
    found = still(address, 160, 100).page.evaluate(HURRY, PLACES["walker"])
    frames, patient = found["frames"], found["patient"]
    assert 1 < len(frames) < 1000
    assert all(frame["cells"] == patient["cells"] and frame["near"] == patient["near"] for frame in frames)
    assert min(frame["drawn"] for frame in frames) > 0.5 * patient["drawn"]
    assert frames[-1] == patient
