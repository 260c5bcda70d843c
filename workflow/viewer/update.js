// One update: from a view to what the GPU draws. Pure of the page and of messages, so the worker, tests and benchmarks
// share it.

import { visible } from "./budget.js";
import { createNear } from "./near.js";
import { nearest } from "./order.js";
import { createRuns, NO_ORDER, PAGE } from "./runs.js";
import { createStore, rowsFor } from "./store.js";
import { createTerrain } from "./terrain.js";

export const BLOCK = 3; // words of a block: page of entries; cell and count; tile, direction, doubt and whole (aboutOf)
const PATIENCE = 4; // milliseconds of making runs in an update that somebody waits for
const MOST_PAGES = 131072; // of orders on the GPU: 8M entries, 32 MB
const FEWEST_PAGES = 1024;

/** Pages of orders that a set may need: three times what all its orders take, within bounds. */
export function pagesFor(manifest) {
  const chunks = manifest.tiles.flatMap((tile) => tile.chunks);
  const all = chunks.reduce((sum, { count, orders }) => sum + 3 * orders.length * Math.ceil(count / PAGE), 0);
  return Math.min(MOST_PAGES, Math.max(FEWEST_PAGES, Math.ceil(all / 32) * 32));
}

export function createUpdate(manifest, heights) {
  const terrain = createTerrain(manifest, heights);
  const store = createStore(terrain, manifest, rowsFor(manifest), (tile) => runs.forget(tile));
  const runs = createRuns(store, terrain, pagesFor(manifest)), nearOrder = createNear(store, terrain);
  const levels = new Uint16Array(terrain.tiles.length); // bits
  let stamp = 0, blocks = new Uint32Array(BLOCK * 4096);

  /** The order of a cell's run: position among those that its finest drawn level keeps, which all its levels do. */
  function orderOf(cell, eye, i0, j0) {
    const { side, ring, z, directions, tiles } = terrain, { at } = cell;
    const to = [
      (i0 + cell.di + 0.5) * side - eye[0], (j0 + cell.dj + 0.5) * side - eye[1],
      ring.h[at] + 0.5 * (z[0] + z[1]) - eye[2],
    ];
    return nearest(directions, tiles[cell.tile].orders[cell.lo], to, ring.east[at], ring.north[at]);
  }

  /** Chunks that are drawn stay: each is told once, however many cells show it. */
  function touch(cells) {
    levels.fill(0);
    for (const { tile, lo, hi } of cells) levels[tile] |= (2 << hi) - (1 << lo);
    for (let tile = 0; tile < levels.length; tile++) {
      for (let level = 0; levels[tile] >> level; level++) if ((levels[tile] >> level) & 1) store.touch(tile, level, stamp);
    }
  }

  function add(cell, pages, n) {
    const which = (cell.di + 128) | ((cell.dj + 128) << 8), about = aboutOf(cell, terrain);
    if (BLOCK * (n + pages.length) > blocks.length) {
      const more = new Uint32Array(2 * BLOCK * (n + pages.length));
      more.set(blocks);
      blocks = more;
    }
    let left = cell.count;
    for (let k = 0, at = BLOCK * n; k < pages.length; k++, left -= PAGE, at += BLOCK) {
      blocks[at] = pages[k];
      blocks[at + 1] = which | ((Math.min(left, PAGE) - 1) << 16);
      blocks[at + 2] = about;
    }
  }

  return {
    terrain,
    store,
    runs,
    add: (chunk) => store.add(chunk, stamp),
    /** camera: eye, right, up, ahead, width, height, focal. patient: make every run, however long that takes. */
    update(camera, budget, patient) {
      const start = performance.now();
      stamp += 1;
      const { eye } = camera, i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
      const seen = visible(terrain, camera, budget), close = [];
      let n = 0, wanting = false;
      const late = () => {
        const now = !patient && performance.now() - start > PATIENCE;
        wanting ||= now;
        return now;
      };
      touch(seen.cells);
      const marks = new Uint32Array(9);
      for (const cell of seen.cells) {
        if (cell.close) {
          cell.direction = NO_ORDER;
          marks[(cell.dj + 1) * 3 + cell.di + 1] = aboutOf(cell, terrain);
          close.push(cell);
          continue;
        }
        const order = orderOf(cell, eye, i0, j0);
        cell.direction = terrain.tiles[cell.tile].orders[cell.lo][order];
        const pages = runs.get(cell.tile, cell.lo, cell.hi, order, stamp, late);
        if (!pages) continue;
        add(cell, pages, n);
        n += pages.length;
      }
      const uploads = runs.uploads(), updated = performance.now();
      const near = nearOrder(close, camera, seen);
      return {
        ...seen, i0, j0, near, marks, uploads, wanting, blocks: blocks.slice(0, BLOCK * n),
        milliseconds: { update: updated - start, sort: performance.now() - updated },
      };
    },
  };
}

/** What the GPU is told of a cell: tile, direction of its order, doubt, and whether one level stands there for all. */
function aboutOf({ tile, direction, whole }, terrain) {
  const doubt = Math.round(255 * Math.min(Math.max(terrain.tiles[tile].uncertainty, 0), 1));
  return tile | (direction << 8) | (doubt << 16) | (Number(whole) << 24);
}
