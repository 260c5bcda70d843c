// Sorted batches: the Gaussians of one tile or object, or of all tiles in a cell where materials meet, of one level or
// of several together, sorted by depth along one direction, as pages for the GPU. They are made when first needed and
// evicted when long unused, those of uncertain tiles last.

import { chunkKey, MAX_LEVELS, MAX_ORDERS, PAGE } from "../data/layout.js";
import { createPagePool, createRecentCache } from "../terrain/caches.js";
import { createDepthSorter, run } from "../terrain/draw_order.js";
import { materialAt } from "../terrain/scatter.js";

/**
 * @typedef {import("../terrain/cells.js").Border} Border
 * @typedef {ReturnType<typeof createBorders>} Borders
 *
 * What a batch is of: see Cell. A batch of a border is of that cell alone.
 * @typedef {{ tile: number, tiles: number[], border: Border | null, lo: number,
 *   hi: number }} Source
 *
 * Is there no more time? spent: milliseconds of making batches of borders since `takeUploads`, ahead of the view too.
 * @typedef {(border: boolean, spent: number) => boolean} IsLate
 *
 * A batch: its pages, and the number of entries in them.
 * @typedef {import("../terrain/caches.js").PoolEntry} Batch
 */

const STEP = 16384; // Gaussians of a batch that are gathered in one step
const AHEAD = 1 / 32; // of all pages
const MOST_BYTES = 64e6; // of indices of Gaussians that stay, of all cells

/**
 * Which Gaussians of each tile stay in the cells where materials meet. That depends on the place alone, so it is found
 * when first needed and kept while there is room.
 *
 * @param {Pick<import("./terrain_tables.js").TerrainTables, "keeper" | "each">} terrain
 * @param {{ get: (tile: number, level: number) => { centres: Float32Array, count: number } }} store
 * @param {number} [most] bytes
 */
export function createBorders({ keeper, each }, store, most = MOST_BYTES) {
  /** @type {ReturnType<typeof createRecentCache<Border, number>>} */
  const known = createRecentCache(most, (bytes) => bytes, (border) => border.kept.clear());
  let tested = 0;
  return {
    /**
     * Indices of a tile's Gaussians that stay in a cell; null: nothing goes anywhere.
     *
     * @param {Border} border @param {number} tile @param {number} level
     */
    keep(border, tile, level) {
      const key = chunkKey(tile, level), old = border.kept.get(key);
      if (old || !keeper) return old ?? null;
      const chunk = store.get(tile, level), kept = keeper.keep(border.i, border.j, chunk, Math.floor(tile / each));
      border.kept.set(key, kept);
      known.keep(border, (known.get(border) ?? 0) + kept.byteLength);
      tested += chunk.count;
      return kept;
    },
    /** Gaussians that were tested so far. */
    get tested() {
      return tested;
    },
    get bytes() {
      return known.size;
    },
  };
}

/**
 * @param {import("./chunk_store.js").ChunkStore} store
 * @param {import("./terrain_tables.js").TerrainTables} terrain @param {Borders} borders
 * @param {number} capacity pages
 */
export function createSortedBatches(store, terrain, borders, capacity) {
  const pool = createPagePool(capacity, undefined, AHEAD * capacity), sort = createDepthSorter();
  const owners = terrain.tiles.length, orderKeys = MAX_LEVELS * MAX_LEVELS * MAX_ORDERS;
  /** @type {{ pages: Uint32Array, entries: Uint32Array }[]} */
  let filled = [];
  /** @type {{ source: Source, order: number, spare: boolean }[]} */
  let due = []; // batches to make between views: substitutes stand in for them, or they may be needed next (spare)
  /** @type {{ source: Source, order: number, steps: ReturnType<typeof sortEntries> } | null} */
  let making = null;
  let spent = 0, sorted = 0, late = 0, depths = new Float32Array(0), unsorted = new Uint32Array(0);
  /** @param {Source} source @param {number} order */
  const keyOf = ({ tile, border, lo, hi }, order) =>
    ((((border?.serial ?? 0) * owners + tile) * MAX_LEVELS + lo) * MAX_LEVELS + hi) * MAX_ORDERS + order;

  /**
   * Entries of levels and tiles, sorted by depth so that none covers another.
   *
   * @param {Source} source @param {number} order
   */
  function* sortEntries({ tile: first, tiles, border, lo, hi }, order) {
    const [x, y, z] = terrain.directions[terrain.tiles[first].orders[order]];
    let n = 0;
    for (let level = lo; level <= hi; level++) {
      for (const tile of tiles) {
        const { centres, entries, count } = store.get(tile, level), kept = border && borders.keep(border, tile, level);
        const many = kept ? kept.length : count;
        makeRoom(n, n + many);
        if (kept) yield; // finding them takes long
        for (let m = 0; m < many;) {
          for (const end = Math.min(many, m + STEP); m < end; m++, n++) {
            const k = kept ? kept[m] : m;
            depths[n] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
            unsorted[n] = entries[k];
          }
          yield;
        }
      }
    }
    const sequence = yield* sort.steps(depths, n), entries = new Uint32Array(padded(n));
    for (let k = 0; k < n; k++) entries[k] = unsorted[sequence[k]];
    sorted += n;
    return { entries, count: n };
  }

  /** Widen the buffers of what is sorted, of which some is used. @param {number} used @param {number} most */
  function makeRoom(used, most) {
    if (depths.length >= most) return;
    const [far, entries] = [depths, unsorted];
    depths = new Float32Array(2 * most);
    unsorted = new Uint32Array(2 * most);
    depths.set(far.subarray(0, used));
    unsorted.set(entries.subarray(0, used));
  }

  /**
   * Batches that may stand in for one that there is no time to make: of another direction; of a border what it showed
   * last, or the tile of the material in its middle.
   *
   * @param {Source} source @param {number} order @param {number} stamp
   * @returns {Batch | null}
   */
  function substitute(source, order, stamp) {
    const { tile, border, lo, hi } = source, { length } = terrain.tiles[tile].orders;
    for (let step = 1; step < length; step++) {
      const other = pool.use(keyOf(source, (order + step) % length), stamp);
      if (other) return other;
    }
    if (!border || !terrain.classes) return null;
    const last = border.last === null ? null : pool.use(border.last, stamp);
    if (last) return last;
    const main = tile % terrain.each + terrain.each * materialAt(terrain.classes, border.i, border.j, 0.5, 0.5);
    const { alone, orders } = terrain.tiles[main];
    return get({ tile: main, tiles: alone, border: null, lo, hi }, Math.min(order, orders.length - 1), stamp);
  }

  /**
   * A batch, made now if need be; null: there is no room.
   *
   * @param {Source} source @param {number} order @param {number} stamp
   * @param {IsLate} [isLate] then a substitute is used if there is one
   * @returns {Batch | null}
   */
  function get(source, order, stamp, isLate = never) {
    const { border } = source, key = keyOf(source, order), shown = border ? border.batch : null;
    if (shown && border && border.last === key && shown.stamp >= 0) { // most cells show what they showed last
      shown.stamp = stamp;
      return shown;
    }
    const there = pool.use(key, stamp);
    if (border && there) remember(border, key, there);
    if (there) return there;
    const other = isLate(border !== null, spent) ? substitute(source, order, stamp) : null;
    if (other) {
      late += 1;
      due.push({ source, order, spare: false });
      return other;
    }
    const begin = performance.now();
    return place(source, order, stamp, run(sortEntries(source, order)), begin);
  }

  /**
   * Give a batch that was made its pages; null: there is no room.
   *
   * @param {Source} source @param {number} order @param {number} stamp
   * @param {{ entries: Uint32Array, count: number }} made @param {number} begin of making it
   */
  function place(source, order, stamp, { entries, count }, begin) {
    const { tile, border } = source, key = keyOf(source, order);
    const batch = pool.allocate(key, entries.length / PAGE, stamp, count, terrain.tiles[tile].all);
    if (!batch) return null;
    filled.push({ pages: batch.pages, entries });
    if (border) {
      remember(border, key, batch);
      spent += performance.now() - begin;
    }
    return batch;
  }

  /** Is it worth making a batch now? @param {typeof due[0]} batch @param {number} stamp */
  function isDue({ source, order, spare }, stamp) {
    const { tiles, lo, hi } = source, levels = (2 << hi) - (1 << lo);
    if (!tiles.every((tile) => (terrain.tiles[tile].arrived & levels) === levels)) return false;
    return !spare || (pool.left > AHEAD * capacity && !pool.use(keyOf(source, order), stamp));
  }

  return {
    get,
    /** A view begins: what was late for the last one does not matter any more. */
    begin() {
      due = [];
      making = null;
    },
    /** Make a batch between views if there is room for it. @param {Source} source @param {number} order */
    prepare: (source, order) => due.push({ source, order, spare: true }),
    /** A step of making a batch that is due. Returns: was there one? @param {number} stamp */
    makeDue(stamp) {
      if (!making) {
        const next = due.shift();
        if (!next) return false;
        if (isDue(next, stamp)) making = { ...next, steps: sortEntries(next.source, next.order) };
        return true;
      }
      const { source, order, steps } = making, begin = performance.now(), { done, value } = steps.next();
      if (!done) return true;
      making = null;
      place(source, order, stamp, value, begin);
      return true;
    },
    /** Batches that are kept. */
    get size() {
      return pool.size;
    },
    /** Batches for which others stood in so far. */
    get late() {
      return late;
    },
    /** Gaussians that were sorted so far. */
    get sorted() {
      return sorted;
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
      making = null;
      if (tile === undefined) filled = [];
    },
  };
}

/** @param {number} count */
const padded = (count) => Math.ceil(count / PAGE) * PAGE;

/** @param {Border} border @param {number} key @param {Batch} batch */
function remember(border, key, batch) {
  border.last = key;
  border.batch = batch;
}

const never = () => false;
