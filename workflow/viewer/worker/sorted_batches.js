// Sorted batches: the Gaussians of one tile, of one level or of several merged, in one direction's order, as pages for
// the GPU. They are made when first needed and evicted when long unused.

import { MAX_LEVELS, MAX_ORDERS, PAGE } from "../data/layout.js";
import { createDepthSorter } from "../terrain/depth_sort.js";
import { createPagePool } from "./page_pool.js";

/**
 * @param {import("./chunk_store.js").ChunkStore} store
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {number} capacity pages
 */
export function createSortedBatches(store, terrain, capacity) {
  const pool = createPagePool(capacity), sort = createDepthSorter();
  /** @type {{ pages: Uint32Array, entries: Uint32Array }[]} */
  let filled = [];
  let depths = new Float32Array(0), union = new Uint32Array(0);
  /** @param {number} tile @param {number} lo @param {number} hi @param {number} order */
  const keyOf = (tile, lo, hi, order) => ((tile * MAX_LEVELS + lo) * MAX_LEVELS + hi) * MAX_ORDERS + order;

  /**
   * Entries of one level in a stored order.
   *
   * @param {number} tile
   * @param {number} level
   * @param {number} order
   */
  function levelEntries(tile, level, order) {
    const { entries, orders, count } = store.get(tile, level), from = order * count;
    const out = new Uint32Array(padded(count));
    for (let k = 0; k < count; k++) out[k] = entries[orders[from + k]];
    return out;
  }

  /**
   * Entries of several levels, sorted together so that neither covers the other.
   *
   * @param {number} tile
   * @param {number} lo
   * @param {number} hi
   * @param {number} order
   */
  function mergedEntries(tile, lo, hi, order) {
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
    const out = new Uint32Array(padded(n)), sequence = sort(depths, n);
    for (let k = 0; k < n; k++) out[k] = union[sequence[k]];
    return out;
  }

  return {
    /**
     * Pages of a batch, made now if need be; null: there is no room.
     *
     * @param {{ tile: number, lo: number, hi: number }} cell
     * @param {number} order
     * @param {number} stamp
     * @param {() => boolean} isLate then a batch of another direction that is at hand is used instead
     */
    get({ tile, lo, hi }, order, stamp, isLate) {
      const key = keyOf(tile, lo, hi, order), there = pool.use(key, stamp);
      if (there) return there;
      if (isLate()) {
        const orders = terrain.tiles[tile].orders[lo].length;
        for (let step = 1; step < orders; step++) {
          const other = pool.use(keyOf(tile, lo, hi, (order + step) % orders), stamp);
          if (other) return other;
        }
      }
      const entries = lo === hi ? levelEntries(tile, lo, order) : mergedEntries(tile, lo, hi, order);
      const pages = pool.allocate(key, entries.length / PAGE, stamp);
      if (pages) filled.push({ pages, entries });
      return pages;
    },
    /** What was made since the last call: page numbers, and PAGE entries for each. */
    takeUploads() {
      const count = filled.reduce((all, { pages }) => all + pages.length, 0);
      const numbers = new Uint32Array(count), data = new Uint32Array(count * PAGE);
      let at = 0;
      for (const { pages, entries } of filled) {
        numbers.set(pages, at);
        data.set(entries, at * PAGE);
        at += pages.length;
      }
      filled = [];
      return { numbers, data };
    },
    /**
     * Forget the batches of a tile (its chunks changed place), or all of them.
     *
     * @param {number} [tile]
     */
    forget(tile) {
      pool.evictWhere((key) => tile === undefined
        || Math.floor(key / (MAX_LEVELS * MAX_LEVELS * MAX_ORDERS)) === tile);
      if (tile === undefined) filled = [];
    },
  };
}

/** @param {number} count */
const padded = (count) => Math.ceil(count / PAGE) * PAGE;
