// Cells of the tile grid: which tile lies in each, and where the surface is, cached while cells stay in view.

import { RING } from "./caches.js";
import { tileAt } from "./choice.js";
import { frameAt, locate } from "./sphere.js";
import { columnOf, tileOn } from "./sphere_edges.js";
import { createThing } from "./scatter.js";

/** @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables */

export const REACH = 48; // tile sides to the last tiles: 97 x 97 cells
const PARTS = 8; // heights within a cell are sampled at (PARTS + 1)^2 points
/** @type {import("./scatter.js").Thing[]} */
const NONE = [];

/**
 * The tile under a point of the ground; on a sphere x and y are longitude and latitude, i is a column of all faces.
 *
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("./heights.js").HeightField} heights @param {number} x @param {number} y
 */
export function tileUnder({ tile_side: side, salt, tiles, materials }, heights, x, y) {
  const variants = tiles.length / (16 * materials.length);
  if (heights.kind === "sphere") {
    const { face, a, b } = locate(heights, frameAt(x, y)[2]), [i, j] = [Math.floor(a), Math.floor(b)];
    return { face, i: columnOf(heights, face, i), j, tile: tileOn(heights, face, i, j, salt, variants) };
  }
  const i = Math.floor(x / side), j = Math.floor(y / side);
  return { i, j, tile: tileAt(i, j, salt, variants) };
}

/**
 * A cell where materials meet. serial: distinguishes it from all others; kept: by chunk, the Gaussians that stay in it;
 * last, batch: key of the batch that was drawn last, and the batch; stale: its classes have changed.
 * @typedef {{ i: number, j: number, serial: number, kept: Map<number, Uint32Array>, last: number | null,
 *   batch: import("./caches.js").PoolEntry | null, stale: boolean }} Border
 *
 * A cache of cells by their coordinates modulo RING: the tile (of the first material), height and slope at the centre,
 * bounds of the height; the tiles of all materials that may show, the Gaussians by level that stay of them and of the
 * objects (where materials meet an estimate by their shares of the cell), and the objects.
 *
 * @typedef {ReturnType<typeof createCellCache>} CellCache
 * @param {number} levels
 */
export function createCellCache(levels) {
  const n = RING * RING, doubles = () => new Float64Array(n);
  return {
    i: doubles().fill(NaN), j: doubles(), tile: new Uint16Array(n), h: doubles(), east: doubles(), north: doubles(),
    low: doubles(), high: doubles(), borders: 0,
    tiles: /** @type {number[][]} */ (new Array(n)), counts: new Int32Array(n * levels),
    things: /** @type {import("./scatter.js").Thing[][]} */ (new Array(n)),
    border: /** @type {(Border | null)[]} */ (new Array(n)),
  };
}

/**
 * Index of a cell in the cache; tiles, objects and surface are computed when it enters.
 *
 * @param {TerrainTables} terrain @param {number} i @param {number} j
 */
export function lookUpCell(terrain, i, j) {
  const { cache, side, heights } = terrain, at = (j & (RING - 1)) * RING + (i & (RING - 1));
  if (cache.i[at] !== i || cache.j[at] !== j) {
    const [h, east, north] = heights.at((i + 0.5) * side, (j + 0.5) * side);
    cache.h[at] = h;
    cache.east[at] = east;
    cache.north[at] = north;
    cache.low[at] = NaN;
    coverCell(terrain, at, i, j);
    cache.i[at] = i;
    cache.j[at] = j;
  }
  return at;
}

/**
 * Tiles and objects of a cell.
 *
 * @param {TerrainTables} terrain
 * @param {number} at index in the cache
 * @param {number} i @param {number} j
 */
function coverCell({ cache, salt, variants, each, tiles, classes, scatter, levels }, at, i, j) {
  const first = tileAt(i, j, salt, variants), bits = classes ? classes.materialsIn(i, j) : 1;
  const objects = each * (classes?.materials ?? 1); // number of the first
  const things = scatter ? scatter.instancesIn(i, j).map((one) => createThing(one, objects)) : NONE;
  const tile = first + each * (31 - Math.clz32(bits & -bits)), alone = (bits & (bits - 1)) === 0;
  cache.tile[at] = tile;
  cache.things[at] = things;
  const old = cache.border[at], same = old && old.i === i && old.j === j ? old : null;
  const { last, batch } = same ?? { last: null, batch: null };
  cache.border[at] = alone ? null : same?.stale === false ? same
    : { i, j, serial: ++cache.borders, kept: new Map(), last, batch, stale: false };
  cache.tiles[at] = tiles[tile].alone;
  if (!alone) {
    const materials = Array.from({ length: classes?.materials ?? 1 }, (_, m) => m).filter((m) => (bits >> m) & 1);
    cache.tiles[at] = materials.map((m) => first + each * m);
  }
  const shares = classes && !alone ? classes.sharesIn(i, j) : null;
  for (let level = 0; level < levels; level++) {
    let sum = 0;
    for (const number of cache.tiles[at]) {
      sum += (shares ? shares[Math.floor(number / each)] : 1) * tiles[number].counts[level];
    }
    for (const thing of things) sum += tiles[thing.tile].counts[level];
    cache.counts[at * levels + level] = Math.ceil(sum);
  }
}

/**
 * Cover cells again when they are next in view: their objects have changed, or their classes (`stale`) too.
 *
 * @param {CellCache} cache @param {boolean} stale
 * @param {[number, number] | null} [cell] null: all cells
 */
export function forgetCells(cache, stale, cell = null) {
  const only = cell && (cell[1] & (RING - 1)) * RING + (cell[0] & (RING - 1));
  for (let at = only ?? 0; at < (only === null ? RING * RING : only + 1); at++) {
    const border = cache.border[at];
    if (cell && (cache.i[at] !== cell[0] || cache.j[at] !== cell[1]) && !Number.isNaN(cache.i[at])) continue;
    cache.i[at] = NaN;
    if (stale && border && (!cell || (border.i === cell[0] && border.j === cell[1]))) border.stale = true;
  }
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
