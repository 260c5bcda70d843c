// Chunks at hand: their bytes in the worker, their rows in the record texture. If a set is larger than the cache, the
// least recently drawn chunks are evicted, but never those of the coarsest level. No chunk is read more than MOST_READS
// times: a chunk that is evicted after its last reading is lost, and a coarser level is drawn instead.

import { CACHE_BYTES, chunkKey, CODE_SHIFT, ROW } from "../data/layout.js";
import { parseChunk } from "../data/layout.js";
import { createPagePool } from "../terrain/caches.js";
import { RIM } from "../terrain/frustum.js";

const MOST_READS = 3;
export const WISHED = 0.5; // added to the stamp of chunks that a view needs: they outlive what stands in for them

/**
 * entries: of each Gaussian its index in the record texture and its level; rows: in that texture.
 * @typedef {import("../data/bundle.js").Chunk & ReturnType<typeof parseChunk>
 *   & { entries: Uint32Array, rows: Uint32Array, stamp: number }} StoredChunk
 * @typedef {ReturnType<typeof createChunkStore>} ChunkStore
 */

/**
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {import("../data/manifest.js").Manifest} manifest @param {number} rows
 * @param {(tile: number) => void} onEvict
 */
export function createChunkStore(terrain, { encoding }, rows, onEvict) {
  /** @type {Map<number, StoredChunk>} */
  const chunks = new Map();
  /** @type {Map<number, number>} */
  const reads = new Map(); // by key
  const coarsest = terrain.levels - 1;
  let bytes = 0;
  /** @param {number} key */
  const stored = (key) => /** @type {StoredChunk} */ (chunks.get(key));
  const pool = createPagePool(rows, (key) => {
    const { tile, level, buffer } = stored(key);
    chunks.delete(key);
    bytes -= buffer.byteLength;
    terrain.tiles[tile].arrived &= ~(1 << level);
    noteAbsence(tile, level);
    onEvict(tile);
  });
  /** @param {number} tile @param {number} level */
  const noteAbsence = (tile, level) => {
    if ((reads.get(chunkKey(tile, level)) ?? 0) >= MOST_READS) terrain.tiles[tile].lost |= 1 << level;
  };
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
   * @param {number} key @param {{ count: number, buffer: ArrayBuffer }} chunk @param {number} stamp
   */
  const allocate = (key, { count, buffer }, stamp) => {
    while (bytes + buffer.byteLength > CACHE_BYTES) if (!evictOldest(stamp)) return null;
    return pool.allocate(key, Math.ceil(count / ROW), stamp, count);
  };
  return {
    /**
     * Add a chunk. Returns: is there room for it? What is being drawn is evicted only for a chunk that the view needs.
     *
     * @param {import("../data/bundle.js").Chunk} chunk @param {number} stamp
     */
    add(chunk, stamp) {
      const { tile, level, count, buffer } = chunk, key = chunkKey(tile, level);
      const needed = (terrain.wish[tile] >> level) & 1;
      reads.set(key, (reads.get(key) ?? 0) + 1);
      const entry = allocate(key, chunk, stamp) ?? (needed ? allocate(key, chunk, stamp + WISHED) : null);
      if (!entry) {
        noteAbsence(tile, level);
        return false;
      }
      const room = entry.pages;
      const mark = level << CODE_SHIFT, entries = new Uint32Array(count), parsed = parseChunk(buffer, count, encoding);
      for (let k = 0; k < count; k++) entries[k] = mark | (room[k >> 10] * ROW + (k & (ROW - 1)));
      const object = terrain.objects[tile - (terrain.tiles.length - terrain.objects.length)];
      if (object) {
        centreOnFoot(parsed.centres, terrain.side);
        object.extent = Math.max(object.extent, measureExtent(parsed, terrain.deviations));
      }
      chunks.set(key, { tile, level, count, buffer, ...parsed, entries, rows: room, stamp });
      bytes += buffer.byteLength;
      terrain.tiles[tile].arrived |= 1 << level;
      this.touch(tile, level, needed ? stamp + WISHED : stamp);
      return true;
    },
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
 * @param {{ centres: Float32Array, sizes: Uint8Array }} parsed
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
