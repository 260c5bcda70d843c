// Cells where materials meet: which Gaussians of each tile stay there, found when first needed.

import { chunkKey } from "../data/layout.js";

const MOST = 2 ** 24; // indices that are kept in memory, of all cells

/**
 * @typedef {import("../terrain/cells.js").Border} Border
 * @typedef {ReturnType<typeof createBorders>} Borders
 */

/**
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {{ get: (tile: number, level: number) => { centres: Float32Array, count: number } }} store
 */
export function createBorders({ classes, each }, store) {
  /** @type {Set<Border>} */
  const known = new Set();
  let total = 0;
  return {
    /**
     * Indices of a tile's Gaussians that stay in a cell.
     *
     * @param {Border} border
     * @param {number} tile
     * @param {number} level
     */
    keep(border, tile, level) {
      const key = chunkKey(tile, level);
      let kept = border.kept.get(key);
      if (kept || !classes) return kept ?? null;
      if (total > MOST) {
        for (const one of known) one.kept.clear();
        known.clear();
        total = 0;
      }
      kept = classes.keep(border.i, border.j, store.get(tile, level), Math.floor(tile / each));
      border.kept.set(key, kept);
      known.add(border);
      total += kept.length;
      return kept;
    },
  };
}
