// Cells of the tile grid: which tile lies in each, and where the surface is, cached while cells stay in view.

import { tileAt } from "./choice.js";

/** @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables */

export const REACH = 48; // tile sides to the last tiles: 97 x 97 cells
const PARTS = 8; // heights within a cell are sampled at (PARTS + 1)^2 points
const RING = 128; // cells along a side of the cache: a power of 2, more than 2 REACH + 1

/**
 * The tile under a point of the ground.
 *
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {number} x
 * @param {number} y
 */
export function tileUnder({ tile_side: side, salt, tiles }, x, y) {
  const i = Math.floor(x / side), j = Math.floor(y / side);
  return { i, j, tile: tileAt(i, j, salt, tiles.length / 16) };
}

/**
 * A cache of cells by their coordinates modulo RING: tile, height and slope at the centre, bounds of the height.
 *
 * @typedef {ReturnType<typeof createCellCache>} CellCache
 */
export function createCellCache() {
  const n = RING * RING, doubles = () => new Float64Array(n);
  return {
    i: doubles().fill(NaN), j: doubles(), tile: new Uint16Array(n), h: doubles(), east: doubles(), north: doubles(),
    low: doubles(), high: doubles(),
  };
}

/**
 * Index of a cell in the cache; tile and surface are computed when it enters.
 *
 * @param {TerrainTables} terrain
 * @param {number} i
 * @param {number} j
 */
export function lookUpCell({ cache, side, salt, variants, heights }, i, j) {
  const at = (j & (RING - 1)) * RING + (i & (RING - 1));
  if (cache.i[at] !== i || cache.j[at] !== j) {
    const [h, east, north] = heights.at((i + 0.5) * side, (j + 0.5) * side);
    cache.i[at] = i;
    cache.j[at] = j;
    cache.tile[at] = tileAt(i, j, salt, variants);
    cache.h[at] = h;
    cache.east[at] = east;
    cache.north[at] = north;
    cache.low[at] = NaN;
  }
  return at;
}

/**
 * Compute bounds of the surface within a cached cell, from heights on a grid and the steepest slope between its points.
 *
 * @param {TerrainTables} terrain
 * @param {number} at index in the cache
 */
export function boundHeights({ cache, side, heights }, at) {
  if (!Number.isNaN(cache.low[at])) return;
  const slack = (heights.steepest * side * Math.SQRT1_2) / PARTS;
  let low = Infinity, high = -Infinity;
  for (let b = 0; b <= PARTS; b++) {
    for (let a = 0; a <= PARTS; a++) {
      const [h] = heights.at((cache.i[at] + a / PARTS) * side, (cache.j[at] + b / PARTS) * side);
      low = Math.min(low, h);
      high = Math.max(high, h);
    }
  }
  cache.low[at] = low - slack;
  cache.high[at] = high + slack;
}
