// Chunks at hand: their bytes in the worker, their rows in the record texture. If a set is larger than the cache, the
// least recently drawn chunks are evicted, but never those of the coarsest level. They come from parts, which are unpacked,
// and chunks composed of them when a view needs them, the nearest first.

import { createComposer, parseRecords } from "../data/compose.js";
import { CACHE_BYTES, chunkBytes, chunkKey, CODE_SHIFT, ROW } from "../data/layout.js";
import { createPagePool } from "../terrain/caches.js";
import { run } from "../terrain/draw_order.js";
import { RIM } from "../terrain/frustum.js";

export const WISHED = 0.5; // added to the stamp of chunks that a view needs: they outlive what stands in for them

/**
 * A chunk: see `parseRecords`.
 * @typedef {{ tile: number, level: number, count: number, records: Uint32Array, centres: Float32Array,
 *   sizes: Uint8Array }} Chunk
 *
 * entries: of each Gaussian its index in the record texture and its level; rows: in that texture.
 * @typedef {Chunk & { entries: Uint32Array, rows: Uint32Array, stamp: number }} StoredChunk
 * @typedef {ReturnType<typeof createChunkStore>} ChunkStore
 */

/**
 * @param {import("./terrain_tables.js").TerrainTables} terrain @param {number} rows
 * @param {(tile: number) => void} onEvict
 */
export function createChunkStore(terrain, rows, onEvict) {
  /** @type {Map<number, StoredChunk>} */
  const chunks = new Map();
  const coarsest = terrain.levels - 1;
  let bytes = 0;
  /** @param {number} key */
  const stored = (key) => /** @type {StoredChunk} */ (chunks.get(key));
  const pool = createPagePool(rows, (key) => {
    const { tile, level, count } = stored(key);
    chunks.delete(key);
    bytes -= chunkBytes(count);
    terrain.tiles[tile].arrived &= ~(1 << level);
    onEvict(tile);
  });
  /** @param {number} stamp */
  const evictOldest = (stamp) => {
    /** @type {number | null} */
    let oldest = null;
    for (const [key, chunk] of chunks) {
      if (chunk.stamp < stamp && (oldest === null || chunk.stamp < stored(oldest).stamp)) oldest = key;
    }
    if (oldest !== null) pool.evictWhere((key) => key === oldest);
    return oldest !== null;
  };
  /**
   * Rows for a chunk, or null if everything else was used at this stamp or later.
   *
   * @param {number} key @param {number} count @param {number} stamp
   */
  const allocate = (key, count, stamp) => {
    while (bytes + chunkBytes(count) > CACHE_BYTES) if (!evictOldest(stamp)) return null;
    return pool.allocate(key, Math.ceil(count / ROW), stamp, count);
  };
  return {
    /**
     * Add a chunk. Returns: is there room for it? What is being drawn is evicted only for a chunk that the view needs.
     *
     * @param {Chunk} chunk @param {number} stamp
     */
    add(chunk, stamp) {
      const { tile, level, count } = chunk, key = chunkKey(tile, level);
      const needed = level === coarsest || (terrain.wish[tile] >> level) & 1;
      const entry = allocate(key, count, stamp) ?? (needed ? allocate(key, count, stamp + WISHED) : null);
      if (!entry) return false;
      const room = entry.pages, mark = level << CODE_SHIFT, entries = new Uint32Array(count);
      for (let k = 0; k < count; k++) entries[k] = mark | (room[k >> 10] * ROW + (k & (ROW - 1)));
      const object = terrain.objects[tile - (terrain.tiles.length - terrain.objects.length)];
      if (object) {
        centreOnFoot(chunk.centres, terrain.side);
        object.extent = Math.max(object.extent, measureExtent(chunk, terrain.deviations));
      }
      chunks.set(key, { ...chunk, entries, rows: room, stamp });
      bytes += chunkBytes(count);
      terrain.tiles[tile].arrived |= 1 << level;
      this.touch(tile, level, needed ? stamp + WISHED : stamp);
      return true;
    },
    /** Is there room for a chunk beside all that is at hand? @param {number} count */
    hasRoom: (count) => bytes + chunkBytes(count) <= CACHE_BYTES && pool.left >= Math.ceil(count / ROW),
    /** A chunk that is at hand. @param {number} tile @param {number} level */
    get: (tile, level) => stored(chunkKey(tile, level)),
    /** Mark a chunk as used. @param {number} tile @param {number} level @param {number} stamp */
    touch(tile, level, stamp) {
      const last = level === coarsest ? Infinity : stamp;
      stored(chunkKey(tile, level)).stamp = last;
      pool.use(chunkKey(tile, level), last);
    },
    all: () => chunks.values(),
    get bytes() {
      return bytes;
    },
  };
}

/** An object's records have its foot in the middle of a tile. @param {Float32Array} centres @param {number} side */
function centreOnFoot(centres, side) {
  for (let k = 0; k < centres.length; k += 3) {
    centres[k] -= 0.5 * side;
    centres[k + 1] -= 0.5 * side;
  }
}

/**
 * Largest distance of a Gaussian's rim from the foot.
 *
 * @param {{ centres: Float32Array, sizes: Uint8Array }} chunk
 * @param {ArrayLike<number>} deviations
 */
function measureExtent({ centres, sizes }, deviations) {
  let most = 0;
  for (let k = 0; k < sizes.length; k++) {
    const away = Math.hypot(centres[3 * k], centres[3 * k + 1], centres[3 * k + 2]);
    most = Math.max(most, away + RIM * deviations[sizes[k]]);
  }
  return most;
}

/**
 * onChunk: a chunk is at hand; onPart: a part was unpacked.
 * @typedef {{ onChunk?: (chunk: StoredChunk) => void,
 *   onPart?: (index: number) => void }} Handlers
 */

/**
 * @param {import("../data/manifest.js").Manifest} manifest @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {ChunkStore} store @param {Handlers} handlers
 */
export function createSupply(manifest, terrain, store, { onChunk = () => {}, onPart = () => {} }) {
  const composer = createComposer(manifest);
  /** @type {Generator<void, unknown>[]} */
  const jobs = []; // parts that came, and a chunk
  // keys of chunks: of the coarsest level, of what the last view lacks, and of what may be needed next
  /** @type {number[][]} */
  let lists = [terrain.tiles.map((_, tile) => chunkKey(tile, terrain.levels - 1)), [], []];
  let stamp = 0, composed = 0;

  /** Unpack a part. @param {number} index @param {ArrayBuffer} buffer */
  function* unpack(index, buffer) {
    yield* composer.add(index, buffer);
    onPart(index);
  }

  /** @param {number} key */
  const isLacking = (key) => !((terrain.tiles[key >> 4].arrived >> (key & 15)) & 1);
  /** @param {number} key */
  const isReady = (key) => isLacking(key) && composer.has(key >> 4, key & 15);
  /** @param {number} key */
  const fits = (key) => isReady(key) && store.hasRoom(terrain.tiles[key >> 4].counts[key & 15]);

  /** Compose a chunk and keep it. Returns: was there room for it? @param {number} key */
  function* bring(key) {
    const tile = key >> 4, level = key & 15;
    lists = lists.map((keys) => keys.filter((other) => other !== key));
    const parsed = yield* parseRecords(yield* composer.compose(tile, level), manifest.encoding);
    const count = parsed.sizes.length;
    composed += count;
    if (!isLacking(key) || !store.add({ tile, level, count, ...parsed }, stamp)) return false;
    onChunk(store.get(tile, level));
    return true;
  }

  /** Take all steps that are under way. */
  const finish = () => {
    for (const job of jobs.splice(0)) run(job);
  };
  /** @param {number[]} keys @returns {boolean} is there more at hand than before? */
  const bringAll = (keys) => keys.filter(isReady).map((key) => run(bring(key))).includes(true);

  return {
    finish,
    /** A view begins: it has at least the coarsest level everywhere. @param {number} now its stamp */
    begin(now) {
      stamp = now;
      bringAll(lists[0]);
      while (lists[0].length && jobs.length) {
        run(jobs[0]);
        jobs.shift();
        bringAll(lists[0]);
      }
    },
    /** Take a part, to be unpacked step by step. @param {number} index @param {ArrayBuffer} buffer */
    addPart: (index, buffer) => void jobs.push(unpack(index, buffer)),
    /** List what a view lacks, the nearest first. @param {import("../terrain/budget.js").Selection} selection */
    want({ cells, missing }) {
      /** @type {Set<number>} */
      const keys = new Set();
      for (let k = cells.length - 1; missing.size && k >= 0; k--) {
        for (const tile of [...cells[k].tiles, ...cells[k].things.map((thing) => thing.tile)]) {
          for (let level = 0; level < terrain.levels; level++) {
            if (missing.has(chunkKey(tile, level))) keys.add(chunkKey(tile, level));
          }
        }
      }
      lists = [lists[0], [...keys, ...missing], []];
    },
    /** List what may be needed next: it is composed if there is room for it. @param {number[]} keys */
    prepare(keys) {
      lists[2] = keys;
    },
    /** Compose what the view lacks. Returns: is there more at hand than before? */
    bringWanted: () => bringAll(lists[1]),
    /** A step of unpacking or composing. Returns: was there one? */
    advance() {
      const key = jobs.length ? 0 : lists[0].find(isReady) ?? lists[1].find(isReady) ?? lists[2].find(fits);
      if (key === undefined) return false;
      if (!jobs.length) jobs.push(bring(key));
      const [job] = jobs;
      let over = true; // as it is after an error
      try {
        over = job.next().done === true;
      } finally {
        if (over) jobs.shift();
      }
      return true;
    },
    /** Records of a chunk, kept or not, whose parts were unpacked. @param {number} tile @param {number} level */
    recordsOf: (tile, level) => run(composer.compose(tile, level)),
    /** Gaussians so far. */
    get composed() {
      return composed;
    },
  };
}
