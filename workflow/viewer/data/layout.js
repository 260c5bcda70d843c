// Layout of what the worker hands to the GPU: record rows, pages of orders, blocks of instances, places of objects. A
// chunk has one 16-byte record a Gaussian (a texel of four 32-bit words). compose.js makes it, and gswt.js for sets
// that the page converts; draw/shaders.js decodes it. An object of the terrain is numbered like a tile, after all.

/**
 * @typedef {import("./manifest.js").Manifest} Manifest
 *
 * How Gaussians were quantized: centre = origin + step * 16 bits; ln(deviation) = log_scale[0] + log_scale[1] * 8 bits.
 *
 * @typedef {{ origin: number[], step: number[], log_scale: number[], sh_degree: number }} Encoding
 */

export const VERSION = 4; // of the manifest
export const RECORD = 16; // bytes: position 3 x 16 bits; deviations, rotation 3 x 8 bits each; colour and opacity
const HELD = 33; // bytes of a Gaussian of a chunk in the worker: record, centre, index, size
export const FARTHEST = 1e9; // of all lengths: single precision keeps their squares finite
export const MAX_STEPS = 65535; // of the grid
const MAX_LOG = 60; // of the logarithm of a deviation
export const MAX_TURN = Math.sin(Math.PI / 8), TURN_STEPS = 127; // largest of a quaternion's x, y, z, and its steps

/** Bytes that a chunk takes in the worker. @param {number} count */
export const chunkBytes = (count) => HELD * count;

/** Is this an encoding that can be decoded? @param {any} value @returns {value is Encoding} */
export function isEncoding(value) {
  /** @param {unknown} list @param {number} size @param {number} most */
  const numbers = (list, size, most) => Array.isArray(list) && list.length === size
    && list.every((v) => Number.isFinite(v) && Math.abs(v) <= most);
  return numbers(value?.origin, 3, FARTHEST) && numbers(value.step, 3, FARTHEST / MAX_STEPS)
    && value.step.every((/** @type {number} */ v) => v >= 0)
    && numbers(value.log_scale, 2, MAX_LOG) && value.log_scale[1] >= 0 && value.sh_degree === 0;
}

/**
 * The standard deviation that a byte of a record stands for.
 *
 * @param {Encoding} encoding @param {number} byte
 */
export const deviationOf = ({ log_scale: [least, rise] }, byte) => Math.exp(least + rise * byte);

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
 * All chunks of a manifest, or those of a level, and the number of the tile or object that each belongs to.
 *
 * @param {Manifest} manifest @param {number} [level]
 */
export function listChunks({ tiles, objects = [] }, level) {
  return [...tiles, ...objects].flatMap(({ chunks, orders }, tile) => chunks.map((entry) => ({ tile, entry, orders })))
    .filter(({ entry }) => level === undefined || entry.level === level);
}

/** Bytes in the worker, and rows of the record texture, of chunks. @param {{ entry: { count: number } }[]} chunks */
const sizeOf = (chunks) => ({
  bytes: chunks.reduce((sum, { entry }) => sum + chunkBytes(entry.count), 0),
  rows: chunks.reduce((sum, { entry }) => sum + Math.ceil(entry.count / ROW), 0),
});

/**
 * Rows of the record texture: for all chunks, or for as many as the cache holds.
 *
 * @param {Manifest} manifest
 */
export const recordRows = (manifest) => (
  Math.max(1, Math.min(sizeOf(listChunks(manifest)).rows, Math.floor(CACHE_BYTES / (RECORD * ROW)), MAX_ROWS)));

/**
 * What a view may use of the chunk cache, beside the coarsest level, in a set that does not fit into it. The rest keeps
 * chunks of the views before, so that turning around or walking a few steps finds them. null: the whole set fits.
 * Negative: not even the coarsest level does.
 *
 * @param {Manifest} manifest
 * @returns {{ bytes: number, rows: number } | null}
 */
export function viewRoom(manifest) {
  const all = sizeOf(listChunks(manifest)), rows = recordRows(manifest);
  if (all.bytes <= CACHE_BYTES && all.rows <= rows) return null;
  const coarsest = sizeOf(listChunks(manifest, manifest.levels.length - 1));
  return { bytes: VIEW_SHARE * (CACHE_BYTES - coarsest.bytes), rows: VIEW_SHARE * (rows - coarsest.rows) };
}

/**
 * Pages of the order texture: three times what all orders of a set take, within bounds.
 *
 * @param {Manifest} manifest
 */
export function orderPages(manifest) {
  const all = listChunks(manifest).reduce((sum, { entry: { count }, orders }) => (
    sum + 3 * orders.length * Math.ceil(count / PAGE)), 0);
  return Math.min(MAX_PAGES, Math.max(manifest.classes ? BORDER_PAGES : MIN_PAGES, Math.ceil(all / 32) * 32));
}

/** The key of a chunk. @param {number} tile @param {number} level */
export const chunkKey = (tile, level) => 16 * tile + level;

/**
 * Least and largest uncertainty of a set.
 *
 * @param {{ uncertainty?: number }[]} tiles
 * @returns {[number, number]}
 */
export function uncertaintyRange(tiles) {
  const values = tiles.map(({ uncertainty }) => uncertainty ?? 0);
  return [Math.min(...values), Math.max(...values)];
}

/**
 * Where a value lies between the ends of a range, 0 to 1; in the middle of a range without extent.
 *
 * @param {number} value @param {[number, number]} range
 */
export const shareOfRange = (value, [low, high]) => (high > low ? Math.min(Math.max((value - low) / (high - low), 0), 1) : 0.5);
