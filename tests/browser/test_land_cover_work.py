"""What the worker does anew for a view of two materials with objects, in Gaussians: little, and nothing twice."""

import pytest
from fixtures.browser import served
from fixtures.land_covers import SIDE, write_cover_bundle
from fixtures.page_visit import VIEWER

from dav_gswt.terrain.heights import Hills
from dav_gswt.terrain.page import write_page

OPEN = """
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { readManifest, readParts } = await import("./data/bundle.js");
  const { chunkKey, listChunks } = await import("./data/layout.js");
  const { webSource } = await import("./data/source.js");
  const source = webSource(new URL("./", location.href)), parts = [];
  const manifest = await readManifest(source), heights = createHeights(manifest.heights);
  await readParts(manifest, source, { take: (...part) => void parts.push(part) });
  // with every chunk at hand
  const fill = () => {
    const filled = createFrameBuilder(manifest, heights);
    for (const [index, buffer] of parts) filled.supply.addPart(index, buffer.slice());
    filled.supply.prepare(listChunks(manifest).map(({ tile, entry }) => chunkKey(tile, entry.level)));
    while (filled.supply.advance());
    return filled;
  };
  const builder = fill();
  const view = (place, patient = true) => {
    const before = builder.work, frame = builder.build(cameraAt(place, 640, 400, heights), 1e6, patient);
    const { work } = builder, did = name => work[name] - before[name];
    return { frame, tested: did("tested"), sorted: did("sorted") };
  };
  const describe = ({ blocks, near, cells }) => {
    let drawn = 0; // entries
    for (let k = 1; k < blocks.length; k += 4) drawn += ((blocks[k] >>> 16) & 63) + 1;
    return { drawn, near: near.length, cells: cells.length };
  };
  const place = { x: 3, y: 5, eye: 0.8, yaw: 60, pitch: -12 };
"""
LOOK_AROUND = """async () => {
  const turn = patient => Array.from({ length: 24 }, (_, k) => view({ ...place, yaw: 15 * k }, patient));
  const sums = views => Object.fromEntries(["tested", "sorted"].map(name => (
    [name, views.reduce((sum, one) => sum + one[name], 0)])));
  const uploads = views => views.reduce((sum, { frame }) => sum + frame.uploads.numbers.length, 0);
  const first = turn(true), again = turn(true), hurried = turn(false);
  return { first: sums(first), again: [sums(again), sums(hurried)], uploads: [uploads(again), uploads(hurried)],
    incomplete: hurried.filter(({ frame }) => frame.incomplete).length };
}"""
AHEAD = """async () => {
  const first = view(place, false).frame.incomplete;
  while (builder.workAhead(1000));
  const next = view(place, false), patient = view(place, true);
  return { first, second: next.frame.incomplete, tested: next.tested + patient.tested,
    frames: [describe(next.frame), describe(patient.frame)] };
}"""
HURRY = """async () => {
  // frames by a builder in a hurry, until they are complete, and the frame of one that is patient
  const camera = cameraAt(place, 640, 400, heights), real = performance.now.bind(performance);
  const hurried = fill(), frames = [], last = fill().build(camera, 1e6, true);
  let now = 0;
  performance.now = () => (now += 0.05); // a clock that leaves time for some dozens of batches
  do frames.push(hurried.build(camera, 1e6, false)); while (frames.at(-1).incomplete && frames.length < 1000);
  performance.now = real;
  return { frames: frames.map(describe), patient: describe(last) };
}"""


@pytest.fixture(scope="module")
def page(blank, tmp_path_factory):
    """A tab beside the viewer's modules and a bundle of two materials over hills."""
    folder = tmp_path_factory.mktemp("work")
    write_cover_bundle(folder / "bundle")
    write_page(folder / "bundle", VIEWER, folder / "page", Hills(1.5 * SIDE, 12.0 * SIDE, 3, 5))
    with served(folder / "page") as address:
        yield blank(address)


def run(page, act: str):
    """The result of a function's body after `OPEN`."""
    return page.evaluate(act.replace("async () => {", "async () => {" + OPEN, 1))


def test_where_the_eye_has_looked_around_nothing_is_made_again(page):
    found = run(page, LOOK_AROUND)
    assert all(count > 0 for count in found["first"].values())
    assert all(set(again.values()) == {0} for again in found["again"])
    assert found["uploads"] == [0, 0] and found["incomplete"] == 0


def test_what_is_late_is_made_between_views(page):
    found = run(page, AHEAD)
    assert found["first"] and not found["second"] and found["tested"] == 0
    assert found["frames"][0] == found["frames"][1]


def test_a_hurried_frame_leaves_no_cell_out_and_is_soon_what_a_patient_one_is(page):
    found = run(page, HURRY)
    frames, patient = found["frames"], found["patient"]
    assert 1 < len(frames) < 1000
    assert all(frame["cells"] == patient["cells"] and frame["near"] == patient["near"] for frame in frames)
    assert min(frame["drawn"] for frame in frames) > 0.5 * patient["drawn"]
    assert frames[-1] == patient
