// Runs: the Gaussians of one tile, of one level or of several together, in one direction's order, ready for the GPU.
// They are made when first needed, kept in pages of the order texture, and dropped when long unused.

import { createSorter } from "./order.js";
import { createPages } from "./pages.js";

export const PAGE = 64; // entries: Gaussians of one block of instances
export const LEVEL_SHIFT = 25, SLOT_SHIFT = 28, NO_SLOT = 15; // entry: index of the Gaussian, its level, its 3 x 3 cell
export const ORDERS = 255; // directions at most
export const NO_ORDER = 255; // instead of one: of cells that are sorted exactly
export const LEVELS = 8; // at most

export function createRuns(store, terrain, capacity) {
  const pages = createPages(capacity), sorted = createSorter();
  let filled = [], depths = new Float32Array(0), union = new Uint32Array(0);
  const keyOf = (tile, lo, hi, order) => ((tile * LEVELS + lo) * LEVELS + hi) * ORDERS + order;

  /** Entries of levels lo to hi in an order; several levels are sorted together, so neither covers the other. */
  function entriesOf(tile, lo, hi, order) {
    if (lo === hi) {
      const { entries, orders, count } = store.get(tile, lo), from = order * count;
      const out = new Uint32Array(padded(count));
      for (let k = 0; k < count; k++) out[k] = entries[orders[from + k]];
      return out;
    }
    const parts = [];
    let n = 0;
    for (let level = lo; level <= hi; level++) {
      parts.push(store.get(tile, level));
      n += parts[level - lo].count;
    }
    if (depths.length < n) [depths, union] = [new Float32Array(2 * n), new Uint32Array(2 * n)];
    const [x, y, z] = terrain.directions[terrain.tiles[tile].orders[lo][order]];
    let at = 0;
    for (const { centres, entries, count } of parts) {
      for (let k = 0; k < count; k++, at++) {
        depths[at] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
        union[at] = entries[k];
      }
    }
    const out = new Uint32Array(padded(n)), sequence = sorted(depths, n);
    for (let k = 0; k < n; k++) out[k] = union[sequence[k]];
    return out;
  }

  return {
    /** Pages of a run, made now if need be; null: there is no room. late(): take another direction's if there is one? */
    get(tile, lo, hi, order, stamp, late) {
      const key = keyOf(tile, lo, hi, order), there = pages.use(key, stamp);
      if (there) return there;
      if (late()) {
        const kept = terrain.tiles[tile].orders[lo].length;
        for (let step = 1; step < kept; step++) {
          const other = pages.use(keyOf(tile, lo, hi, (order + step) % kept), stamp);
          if (other) return other;
        }
      }
      const entries = entriesOf(tile, lo, hi, order);
      const taken = pages.take(key, entries.length / PAGE, stamp);
      if (taken) filled.push({ pages: taken, entries });
      return taken;
    },
    /** What has been made since the last call: page numbers, and PAGE entries for each. */
    uploads() {
      const count = filled.reduce((all, { pages: p }) => all + p.length, 0);
      const numbers = new Uint32Array(count), data = new Uint32Array(count * PAGE);
      let at = 0;
      for (const run of filled) {
        numbers.set(run.pages, at);
        data.set(run.entries, at * PAGE);
        at += run.pages.length;
      }
      filled = [];
      return { numbers, data };
    },
    /** Forget the runs of a tile (its chunks changed place), or all of them. */
    forget(tile) {
      pages.dropWhere((key) => tile === undefined || Math.floor(key / (LEVELS * LEVELS * ORDERS)) === tile);
      if (tile === undefined) filled = [];
    },
  };
}

const padded = (count) => Math.ceil(count / PAGE) * PAGE;
