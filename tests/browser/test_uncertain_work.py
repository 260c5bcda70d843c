"""What the worker does ahead where tiles are uncertain, which keep all directions: the next orders are made."""

import pytest
from fixtures.browser import served
from fixtures.bundles import Ground

GROUND = Ground(discs=32, levels=3)
LOOK = """async kept => {
  const { createFrameBuilder } = await import("./worker/frame_builder.js");
  const { createHeights } = await import("./terrain/heights.js");
  const { cameraAt } = await import("./terrain/camera.js");
  const { readManifest, readParts } = await import("./data/bundle.js");
  const { webSource } = await import("./data/source.js");
  const source = webSource(new URL("./", location.href)), manifest = await readManifest(source);
  for (const tile of manifest.tiles) tile.orders = tile.orders.slice(0, kept);
  const heights = createHeights(manifest.heights), builder = createFrameBuilder(manifest, heights);
  await readParts(manifest, source, { take: (index, buffer) => builder.supply.addPart(index, buffer) });
  const view = yaw => builder.build(cameraAt({ x: 3, y: 5, eye: 0.8, yaw, pitch: -12 }, 640, 400, heights), 1e6, false);
  const missing = view(20).missing.size;
  while (builder.workAhead(1000));
  view(20);
  while (builder.workAhead(1000));
  const { work } = builder, frame = view(20);
  while (builder.workAhead(1000));
  const rest = builder.work;
  return { missing, work, rest, left: frame.missing.size, incomplete: frame.incomplete };
}"""


@pytest.fixture(scope="module")
def looks(blank, page_of):
    """What is done for a view, by how many of nine directions are kept."""
    with served(page_of(GROUND)) as address:
        tab = blank(address)
        yield {kept: tab.evaluate(LOOK, kept) for kept in (8, 9)}


def test_between_views_all_is_composed_that_was_missing_and_at_rest_nothing_more(looks):
    for found in looks.values():
        assert found["missing"] > 0 and found["left"] == 0 and not found["incomplete"]
        assert found["rest"] == found["work"]


def test_where_tiles_are_uncertain_the_next_orders_are_ready(looks):
    certain, uncertain = looks[8], looks[9]
    assert uncertain["work"]["batches"] > 1.5 * certain["work"]["batches"]
    assert uncertain["work"]["composed"] >= certain["work"]["composed"]


def test_of_equal_age_what_is_kept_goes_last(modules):
    found = modules.evaluate(
        """async () => {
          const { createPagePool } = await import("./terrain/caches.js"), gone = [];
          const pool = createPagePool(4, key => gone.push(key));
          [[1, true], [2, false], [3, true], [4, false]].forEach(([key, kept], k) => pool.allocate(key, 1, k, 1, kept));
          for (let key = 5; key < 8; key++) pool.allocate(key, 1, 9, 1);
          return gone;
        }"""
    )
    assert found == [2, 4, 1]
