// Exact orders of chunks by depth: found when first needed, kept while there is room. A cell that shows several levels
// or materials merges them instead of sorting its own Gaussians.

import { chunkKey, MAX_ORDERS } from "../data/layout.js";
import { indexType } from "../data/layout.js";
import { createDepthSorter } from "../terrain/draw_order.js";

const MOST_BYTES = 64e6; // of all orders

/**
 * Indices of a chunk's Gaussians, back to front.
 * @typedef {Uint16Array | Uint32Array} DepthOrder
 * @typedef {ReturnType<typeof createDepthOrders>} DepthOrders
 */

/**
 * Stored orders have 65535 steps of depth; these have all bits, and of equal depths the smaller index comes first.
 *
 * @param {{ get: (tile: number, level: number) => { centres: Float32Array, count: number } }} store
 * @param {{ directions: number[][] }} terrain
 * @param {number} [most] bytes
 */
export function createDepthOrders(store, { directions }, most = MOST_BYTES) {
  const sort = createDepthSorter();
  /** @type {Map<number, DepthOrder>} */
  const known = new Map(); // the latest last
  let bytes = 0, sorted = 0, depths = new Float32Array(0);

  /** @param {{ centres: Float32Array, count: number }} chunk @param {number[]} direction @returns {DepthOrder} */
  function sortChunk({ centres, count }, [x, y, z]) {
    if (depths.length < count) depths = new Float32Array(2 * count);
    for (let k = 0; k < count; k++) depths[k] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
    sorted += count;
    return new (indexType(count))(sort(depths, count));
  }

  return {
    /**
     * The order of a chunk that is at hand.
     *
     * @param {number} tile
     * @param {number} level
     * @param {number} direction
     * @returns {DepthOrder}
     */
    get(tile, level, direction) {
      const key = chunkKey(tile, level) * MAX_ORDERS + direction, old = known.get(key);
      const order = old ?? sortChunk(store.get(tile, level), directions[direction]);
      known.delete(key);
      known.set(key, order);
      if (!old) bytes += order.byteLength;
      for (const [oldest, { byteLength }] of known) {
        if (bytes <= most || oldest === key) break;
        known.delete(oldest);
        bytes -= byteLength;
      }
      return order;
    },
    /** Gaussians that were sorted so far. */
    get sorted() {
      return sorted;
    },
    get bytes() {
      return bytes;
    },
  };
}
