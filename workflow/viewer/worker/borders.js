// Cells where materials meet: which Gaussians of each tile stay there. That depends on the place alone, so it is found
// when first needed and kept while there is room, longest for the cells that were asked for last.

import { chunkKey } from "../data/layout.js";

const MOST_BYTES = 64e6; // of indices, of all cells

/**
 * @typedef {import("../terrain/cells.js").Border} Border
 * @typedef {ReturnType<typeof createBorders>} Borders
 */

/**
 * @param {Pick<import("./terrain_tables.js").TerrainTables, "keeper" | "each">} terrain
 * @param {{ get: (tile: number, level: number) => { centres: Float32Array, count: number } }} store
 * @param {number} [most] bytes
 */
export function createBorders({ keeper, each }, store, most = MOST_BYTES) {
  /** @type {Map<Border, number>} */
  const known = new Map(); // bytes of each, the latest last
  let bytes = 0, tested = 0;

  /**
   * Forget what stays in a cell: its classes have changed, or there is no more room. A cell that is covered anew has a
   * Border of its own, so only the memory of the old one is at stake.
   *
   * @param {Border} border
   */
  function forget(border) {
    bytes -= known.get(border) ?? 0;
    known.delete(border);
    border.kept.clear();
  }

  return {
    /**
     * Indices of a tile's Gaussians that stay in a cell.
     *
     * @param {Border} border
     * @param {number} tile
     * @param {number} level
     */
    keep(border, tile, level) {
      const key = chunkKey(tile, level), old = border.kept.get(key);
      if (old || !keeper) return old ?? null;
      const chunk = store.get(tile, level), kept = keeper.keep(border.i, border.j, chunk, Math.floor(tile / each));
      const own = (known.get(border) ?? 0) + kept.byteLength;
      border.kept.set(key, kept);
      known.delete(border);
      known.set(border, own);
      bytes += kept.byteLength;
      tested += chunk.count;
      for (const oldest of known.keys()) {
        if (bytes <= most || oldest === border) break;
        forget(oldest);
      }
      return kept;
    },
    forget,
    /** Gaussians that were tested so far. */
    get tested() {
      return tested;
    },
    get bytes() {
      return bytes;
    },
  };
}
