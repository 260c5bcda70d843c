// Layout of what the worker hands to the GPU: record rows, pages of orders, blocks of instances, places of objects.
// Shared by both sides. An object of the terrain is numbered like a tile, after all tiles.

import { RECORD } from "./records.js";

/** @typedef {import("./manifest.js").Manifest} Manifest */

export const ROW = 1024; // Gaussians in a row of the record texture
export const PAGE = 64; // entries of an order: Gaussians of one block of instances
export const PAGES_A_ROW = 32; // of the order texture
export const BLOCK = 4; // words of a block: page; cell and count; tile, direction, uncertainty and whole; place, or 0
export const MAX_LEVELS = 8;
export const CODE_SHIFT = 22; // bits of an entry: index of the Gaussian, code
export const SLOTS = MAX_LEVELS; // codes below are levels; from here on MAX_LEVELS slot + level in the near block
export const PLACES = SLOTS + 9 * MAX_LEVELS; // codes from here on are places of objects in the near block
export const MAX_NEAR_PLACES = (1 << (32 - CODE_SHIFT)) - PLACES;
export const PLACE = 8; // words of an object's place: cells east and north of the eye's, cosine and sine times size,
// z of the foot, size; tile, direction, uncertainty and whole as of a block; level. Of a sphere's cell: its middle from
// the eye, two tangents, face; tile, direction, uncertainty and whole
export const PLACES_A_ROW = 512; // of the texture of places, two texels each
export const MAX_ORDERS = 255; // directions
export const NO_ORDER = 255; // direction of cells that are sorted by depth
export const NEAR = 0.1; // near plane, as a share of the eye floor
export const CACHE_BYTES = 192e6; // of chunks that are kept in memory
const VIEW_SHARE = 0.75; // of the cache, for one view: with half of it the nearest ground is often coarser
const MAX_ROWS = 4096; // every graphics card has textures of this height
export const MAX_COUNT = MAX_ROWS * ROW; // Gaussians of a chunk
const MAX_PAGES = 131072, MIN_PAGES = 1024; // of orders on the GPU: at most 8M entries, 32 MB
const BORDER_PAGES = 65536; // at least with several materials: a cell where they meet has orders of its own

/**
 * All chunks of a manifest, and the number of the tile or object that each belongs to.
 *
 * @param {Manifest} manifest
 */
export function listChunks({ tiles, objects = [] }) {
  return [...tiles, ...objects].flatMap(({ chunks }, tile) => chunks.map((entry) => ({ tile, entry })));
}

/**
 * Rows of the record texture: for all chunks, or for as many as the cache holds.
 *
 * @param {Manifest} manifest
 */
export function recordRows(manifest) {
  const all = listChunks(manifest).reduce((sum, { entry }) => sum + Math.ceil(entry.count / ROW), 0);
  return Math.max(1, Math.min(all, Math.floor(CACHE_BYTES / (RECORD * ROW)), MAX_ROWS));
}

/**
 * What a view may use of the chunk cache in a set that does not fit into it. The rest keeps chunks of the views before, so
 * that turning around or walking a few steps finds them. null: the whole set fits.
 *
 * @param {Manifest} manifest
 * @returns {{ bytes: number, rows: number } | null}
 */
export function viewRoom(manifest) {
  const chunks = listChunks(manifest), rows = recordRows(manifest);
  const allBytes = chunks.reduce((sum, { entry }) => sum + entry.bytes, 0);
  const allRows = chunks.reduce((sum, { entry }) => sum + Math.ceil(entry.count / ROW), 0);
  return allBytes <= CACHE_BYTES && allRows <= rows ? null : { bytes: VIEW_SHARE * CACHE_BYTES, rows: VIEW_SHARE * rows };
}

/**
 * Pages of the order texture: three times what all orders of a set take, within bounds.
 *
 * @param {Manifest} manifest
 */
export function orderPages(manifest) {
  const all = listChunks(manifest).reduce((sum, { entry: { count, orders } }) => (
    sum + 3 * orders.length * Math.ceil(count / PAGE)), 0);
  return Math.min(MAX_PAGES, Math.max(manifest.classes ? BORDER_PAGES : MIN_PAGES, Math.ceil(all / 32) * 32));
}

/**
 * The key of a chunk.
 *
 * @param {number} tile
 * @param {number} level
 */
export const chunkKey = (tile, level) => 16 * tile + level;
