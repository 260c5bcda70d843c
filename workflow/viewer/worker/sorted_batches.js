// Sorted batches: the Gaussians of one tile or object, or of all tiles in a cell where materials meet, of one level or
// of several merged, in one direction's order, as pages for the GPU. They are made when first needed and evicted when
// long unused.

import { MAX_LEVELS, MAX_ORDERS, PAGE } from "../data/layout.js";
import { createDepthSorter } from "../terrain/depth_sort.js";
import { materialAt } from "../terrain/scatter.js";
import { createPagePool } from "./page_pool.js";

const FIRST = 6; // times as long may the first batches of cells take: another material may stand in for them

/**
 * What a batch is of: see Cell. A batch of a border is of that cell alone.
 * @typedef {{ tile: number, tiles: number[], border: import("../terrain/cells.js").Border | null, lo: number,
 *   hi: number }} Source
 *
 * Is there no more time? spent: milliseconds of making batches of borders since `takeUploads`.
 * @typedef {(border: boolean, spent: number) => boolean} IsLate
 *
 * A batch: its pages, and the number of entries in them.
 * @typedef {import("./page_pool.js").PoolEntry} Batch
 */

/**
 * @param {import("./chunk_store.js").ChunkStore} store
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {import("./borders.js").Borders} borders
 * @param {number} capacity pages
 */
export function createSortedBatches(store, terrain, borders, capacity) {
  const pool = createPagePool(capacity), sort = createDepthSorter();
  const owners = terrain.tiles.length, orderKeys = MAX_LEVELS * MAX_LEVELS * MAX_ORDERS;
  /** @type {{ pages: Uint32Array, entries: Uint32Array }[]} */
  let filled = [];
  let spent = 0, depths = new Float32Array(0), union = new Uint32Array(0);
  /** @param {Source} source @param {number} order */
  const keyOf = ({ tile, border, lo, hi }, order) =>
    ((((border?.serial ?? 0) * owners + tile) * MAX_LEVELS + lo) * MAX_LEVELS + hi) * MAX_ORDERS + order;

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
    return { entries: out, count };
  }

  /**
   * Entries of several levels or tiles, sorted together so that none covers another.
   *
   * @param {Source} source
   * @param {number} order
   */
  function mergedEntries({ tile: first, tiles, border, lo, hi }, order) {
    const parts = [];
    let n = 0;
    for (let level = lo; level <= hi; level++) {
      for (const tile of tiles) {
        const chunk = store.get(tile, level), kept = border && borders.keep(border, tile, level);
        parts.push({ chunk, kept });
        n += kept ? kept.length : chunk.count;
      }
    }
    if (depths.length < n) [depths, union] = [new Float32Array(2 * n), new Uint32Array(2 * n)];
    const [x, y, z] = terrain.directions[terrain.tiles[first].orders[lo][order]];
    let at = 0;
    for (const { chunk: { centres, entries, count }, kept } of parts) {
      const many = kept ? kept.length : count;
      for (let n = 0; n < many; n++, at++) {
        const k = kept ? kept[n] : n;
        depths[at] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
        union[at] = entries[k];
      }
    }
    const out = new Uint32Array(padded(n)), sequence = sort(depths, n);
    for (let k = 0; k < n; k++) out[k] = union[sequence[k]];
    return { entries: out, count: n };
  }

  /**
   * Batches that may stand in for one that there is no time to make: of another direction; of a border what it showed
   * last, or the tile of the material in its middle.
   *
   * @param {Source} source
   * @param {number} order
   * @param {number} stamp
   * @returns {Batch | null}
   */
  function substitute(source, order, stamp) {
    const { tile, border, lo, hi } = source, { length } = terrain.tiles[tile].orders[lo];
    for (let step = 1; step < length; step++) {
      const other = pool.use(keyOf(source, (order + step) % length), stamp);
      if (other) return other;
    }
    if (!border || !terrain.classes) return null;
    const last = border.last === null ? null : pool.use(border.last, stamp);
    if (last) return last;
    const main = tile % terrain.each + terrain.each * materialAt(terrain.classes, border.i, border.j, 0.5, 0.5);
    const { alone, orders } = terrain.tiles[main];
    return get({ tile: main, tiles: alone, border: null, lo, hi }, Math.min(order, orders[lo].length - 1), stamp);
  }

  /**
   * A batch, made now if need be; null: there is no room.
   *
   * @param {Source} source
   * @param {number} order
   * @param {number} stamp
   * @param {IsLate} [isLate] then a substitute is used if there is one
   * @returns {Batch | null}
   */
  function get(source, order, stamp, isLate = () => false) {
    const { tile, border, lo, hi } = source, key = keyOf(source, order), there = pool.use(key, stamp);
    if (border && there) border.last = key;
    if (there) return there;
    const waits = border && border.last === null ? spent / FIRST : spent;
    const other = isLate(border !== null, waits) ? substitute(source, order, stamp) : null;
    if (other) return other;
    const begin = border ? performance.now() : 0;
    const { entries, count } = lo === hi && !border ? levelEntries(tile, lo, order) : mergedEntries(source, order);
    const batch = pool.allocate(key, entries.length / PAGE, stamp, count);
    if (!batch) return null;
    filled.push({ pages: batch.pages, entries });
    if (border) {
      border.last = key;
      spent += performance.now() - begin;
    }
    return batch;
  }

  return {
    get,
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
      spent = 0;
      return { numbers, data };
    },
    /**
     * Forget the batches of a tile (its chunks changed place) and of all borders that may show it, or all batches.
     *
     * @param {number} [tile]
     */
    forget(tile) {
      pool.evictWhere((key) => {
        const source = Math.floor(key / orderKeys), owner = source % owners;
        return tile === undefined || owner === tile
          || (source >= owners && owner % terrain.each === tile % terrain.each);
      });
      if (tile === undefined) filled = [];
    },
  };
}

/** @param {number} count */
const padded = (count) => Math.ceil(count / PAGE) * PAGE;
