// Chunks at hand: their bytes in the worker, their rows in the record texture. If a set is larger than the cache, the
// least recently drawn chunks are evicted, but never those of the coarsest level.

import { CACHE_BYTES, chunkBytes, chunkKey, CODE_SHIFT, ROW } from "../data/layout.js";
import { createPagePool } from "../terrain/caches.js";
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
