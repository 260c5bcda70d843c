// Layout of what the worker hands to the GPU: record rows, pages of orders, blocks of instances. Shared by both sides.

import { RECORD } from "./records.js";

/** @typedef {import("./manifest.js").Manifest} Manifest */

export const ROW = 1024; // Gaussians in a row of the record texture
export const PAGE = 64; // entries of an order: Gaussians of one block of instances
export const PAGES_A_ROW = 32; // of the order texture
export const BLOCK = 3; // words of a block: page; cell and count; tile, direction, uncertainty and whole
export const LEVEL_SHIFT = 25, SLOT_SHIFT = 28; // bits of an entry: index of the Gaussian, level, slot of the near block
export const NO_SLOT = 15; // slot of entries that belong to no cell of the near block
export const MAX_LEVELS = 8;
export const MAX_ORDERS = 255; // directions
export const NO_ORDER = 255; // direction of cells that are sorted by depth
export const NEAR = 0.1; // near plane, as a share of the eye floor
export const CACHE_BYTES = 192e6; // of chunks that are kept in memory
const MAX_ROWS = 4096; // every graphics card has textures of this height
const MAX_PAGES = 131072, MIN_PAGES = 1024; // of orders on the GPU: at most 8M entries, 32 MB

/**
 * Rows of the record texture: for all chunks, or for as many as the cache holds.
 *
 * @param {Manifest} manifest
 */
export function recordRows(manifest) {
  const chunks = manifest.tiles.flatMap((tile) => tile.chunks);
  const all = chunks.reduce((sum, { count }) => sum + Math.ceil(count / ROW), 0);
  return Math.max(1, Math.min(all, Math.floor(CACHE_BYTES / (RECORD * ROW)), MAX_ROWS));
}

/**
 * Pages of the order texture: three times what all orders of a set take, within bounds.
 *
 * @param {Manifest} manifest
 */
export function orderPages(manifest) {
  const chunks = manifest.tiles.flatMap((tile) => tile.chunks);
  const all = chunks.reduce((sum, { count, orders }) => sum + 3 * orders.length * Math.ceil(count / PAGE), 0);
  return Math.min(MAX_PAGES, Math.max(MIN_PAGES, Math.ceil(all / 32) * 32));
}

/**
 * The key of a chunk.
 *
 * @param {number} tile
 * @param {number} level
 */
export const chunkKey = (tile, level) => 16 * tile + level;
