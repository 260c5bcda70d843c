// The chunks that are at hand: their bytes in the worker, their rows in the texture of all records. Bounded: where a
// set is larger than the bound, chunks that have not been drawn for longest give way.

import { createPages } from "./pages.js";
import { parts, RECORD } from "./records.js";
import { LEVEL_SHIFT, NO_SLOT, SLOT_SHIFT } from "./runs.js";

export const ROW = 1024; // Gaussians in a row of the texture
export const BOUND = 192e6; // bytes of chunks that are kept
const MOST_ROWS = 4096; // every graphics card has textures so tall

/** Rows that a set needs on the GPU: of all chunks, or of as many as the bound allows. */
export function rowsFor(manifest) {
  const chunks = manifest.tiles.flatMap((tile) => tile.chunks);
  const all = chunks.reduce((sum, { count }) => sum + Math.ceil(count / ROW), 0);
  return Math.max(1, Math.min(all, Math.floor(BOUND / (RECORD * ROW)), MOST_ROWS));
}

export function createStore(terrain, { encoding }, rows, onEvict) {
  const chunks = new Map();
  let bytes = 0;
  const keyOf = (tile, level) => 16 * tile + level;
  const pages = createPages(rows, (key) => {
    const { tile, level, buffer } = chunks.get(key);
    chunks.delete(key);
    bytes -= buffer.byteLength;
    terrain.tiles[tile].arrived &= ~(1 << level);
    onEvict(tile);
  });
  const evictOldest = (stamp) => {
    let oldest = null;
    for (const [key, chunk] of chunks) {
      if (chunk.stamp < stamp && (!oldest || chunk.stamp < chunks.get(oldest).stamp)) oldest = key;
    }
    if (oldest !== null) pages.dropWhere((key) => key === oldest);
    return oldest !== null;
  };
  return {
    /** Take a chunk in. Returns: its rows in the texture, or null where all room is taken by what is being drawn. */
    add({ tile, level, count, buffer }, stamp) {
      while (bytes + buffer.byteLength > BOUND && evictOldest(stamp));
      const key = keyOf(tile, level), room = pages.take(key, Math.ceil(count / ROW), stamp);
      if (!room) return null;
      const { orders, centres, sizes, records } = parts(buffer, count, encoding);
      const mark = ((NO_SLOT << SLOT_SHIFT) | (level << LEVEL_SHIFT)) >>> 0;
      const entries = new Uint32Array(count); // of each Gaussian: where it is on the GPU, and its level
      for (let k = 0; k < count; k++) entries[k] = (mark | (room[k >> 10] * ROW + (k & (ROW - 1)))) >>> 0;
      chunks.set(key, { tile, level, count, buffer, records, orders, centres, sizes, entries, rows: room, stamp });
      bytes += buffer.byteLength;
      terrain.tiles[tile].arrived |= 1 << level;
      return room;
    },
    get: (tile, level) => chunks.get(keyOf(tile, level)),
    /** A chunk was drawn at `stamp`. */
    touch(tile, level, stamp) {
      chunks.get(keyOf(tile, level)).stamp = stamp;
      pages.use(keyOf(tile, level), stamp);
    },
    all: () => chunks.values(),
    get bytes() {
      return bytes;
    },
  };
}
