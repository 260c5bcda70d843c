// Chunks at hand: their bytes in the worker, their rows in the record texture. Where a set is larger than the cache,
// the least recently drawn chunks are evicted.

import { CACHE_BYTES, chunkKey, LEVEL_SHIFT, NO_SLOT, ROW, SLOT_SHIFT } from "../data/layout.js";
import { parseChunk } from "../data/records.js";
import { createPagePool } from "./page_pool.js";

/**
 * entries: of each Gaussian its index in the record texture and its level; rows: in that texture.
 * @typedef {import("../data/bundle.js").Chunk & ReturnType<typeof parseChunk>
 *   & { entries: Uint32Array, rows: Uint32Array, stamp: number }} StoredChunk
 * @typedef {ReturnType<typeof createChunkStore>} ChunkStore
 */

/**
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {number} rows
 * @param {(tile: number) => void} onEvict
 */
export function createChunkStore(terrain, { encoding }, rows, onEvict) {
  /** @type {Map<number, StoredChunk>} */
  const chunks = new Map();
  let bytes = 0;
  /** @param {number} key */
  const stored = (key) => /** @type {StoredChunk} */ (chunks.get(key));
  const pool = createPagePool(rows, (key) => {
    const { tile, level, buffer } = stored(key);
    chunks.delete(key);
    bytes -= buffer.byteLength;
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
  return {
    /**
     * Add a chunk. Returns: is there room for it, beside what is being drawn?
     *
     * @param {import("../data/bundle.js").Chunk} chunk
     * @param {number} stamp
     */
    add({ tile, level, count, buffer }, stamp) {
      while (bytes + buffer.byteLength > CACHE_BYTES && evictOldest(stamp));
      const key = chunkKey(tile, level), room = pool.allocate(key, Math.ceil(count / ROW), stamp);
      if (!room) return false;
      const mark = ((NO_SLOT << SLOT_SHIFT) | (level << LEVEL_SHIFT)) >>> 0;
      const entries = new Uint32Array(count);
      for (let k = 0; k < count; k++) entries[k] = (mark | (room[k >> 10] * ROW + (k & (ROW - 1)))) >>> 0;
      chunks.set(key, {
        tile, level, count, buffer, ...parseChunk(buffer, count, encoding), entries, rows: room, stamp,
      });
      bytes += buffer.byteLength;
      terrain.tiles[tile].arrived |= 1 << level;
      return true;
    },
    /**
     * A chunk that is at hand.
     *
     * @param {number} tile
     * @param {number} level
     */
    get: (tile, level) => stored(chunkKey(tile, level)),
    /**
     * Mark a chunk as drawn.
     *
     * @param {number} tile
     * @param {number} level
     * @param {number} stamp
     */
    touch(tile, level, stamp) {
      stored(chunkKey(tile, level)).stamp = stamp;
      pool.use(chunkKey(tile, level), stamp);
    },
    all: () => chunks.values(),
    get bytes() {
      return bytes;
    },
  };
}
