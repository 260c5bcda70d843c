// What the worker knows of a terrain: its tables, and of each cell the tile and the surface.

import { tileAt } from "./choice.js";
import { deviationOf, largestOf } from "./records.js";

export const REACH = 48; // tile sides to the end of what is laid: 97 x 97 cells
export const NEAR = 0.1; // Gaussians nearer than this share of the eye floor are left out
const PARTS = 8; // a cell is measured at (PARTS + 1)^2 points
const RING = 128; // cells along a side of the cache of surfaces: a power of 2, more than 2 REACH + 1

/** Sizes and counts of a manifest in tables; `arrived` grows with its chunks, `cells` are used again by each view. */
export function createTerrain(manifest, heights) {
  const { tile_side: side, salt, levels, directions } = manifest;
  const tiles = manifest.tiles.map(({ z, chunks, uncertainty }) => {
    const byLevel = [...chunks].sort((a, b) => a.level - b.level);
    return {
      z, uncertainty: uncertainty ?? 0, arrived: 0,
      counts: byLevel.map((chunk) => chunk.count), orders: byLevel.map((chunk) => chunk.orders),
    };
  });
  return {
    side, salt, directions, heights, tiles, variants: tiles.length / 16, levels: levels.length,
    largest: largestOf(manifest.encoding),
    deviations: Float64Array.from({ length: 256 }, (_, byte) => deviationOf(manifest.encoding, byte)),
    switches: levels.map(({ distance }) => distance ?? Infinity), bands: levels.map(({ band }) => band ?? 0),
    z: [Math.min(...tiles.map((tile) => tile.z[0])), Math.max(...tiles.map((tile) => tile.z[1]))],
    near: NEAR * manifest.eye_floor, ring: createRing(), cells: [],
  };
}

/** The number of the tile under a point of the ground. */
export function tileUnder({ tile_side: side, salt, tiles }, x, y) {
  const i = Math.floor(x / side), j = Math.floor(y / side);
  return { i, j, tile: tileAt(i, j, salt, tiles.length / 16) };
}

function createRing() {
  const n = RING * RING, doubles = () => new Float64Array(n);
  return {
    i: doubles().fill(NaN), j: doubles(), tile: new Uint16Array(n), h: doubles(), east: doubles(), north: doubles(),
    low: doubles(), high: doubles(),
  };
}

/** Where the ring holds a cell's tile and the surface at its middle; both are worked out when it comes in sight. */
export function lookUp({ ring, side, salt, variants, heights }, i, j) {
  const at = (j & (RING - 1)) * RING + (i & (RING - 1));
  if (ring.i[at] !== i || ring.j[at] !== j) {
    const [h, east, north] = heights.at((i + 0.5) * side, (j + 0.5) * side);
    ring.i[at] = i;
    ring.j[at] = j;
    ring.tile[at] = tileAt(i, j, salt, variants);
    ring.h[at] = h;
    ring.east[at] = east;
    ring.north[at] = north;
    ring.low[at] = NaN;
  }
  return at;
}

/** Bounds of the surface within a cell, from its heights on a grid and the steepest slope between its points. */
export function measure({ ring, side, heights }, at) {
  if (!Number.isNaN(ring.low[at])) return;
  const slack = (heights.steepest * side * Math.SQRT1_2) / PARTS;
  let low = Infinity, high = -Infinity;
  for (let b = 0; b <= PARTS; b++) {
    for (let a = 0; a <= PARTS; a++) {
      const [h] = heights.at((ring.i[at] + a / PARTS) * side, (ring.j[at] + b / PARTS) * side);
      low = Math.min(low, h);
      high = Math.max(high, h);
    }
  }
  ring.low[at] = low - slack;
  ring.high[at] = high + slack;
}
