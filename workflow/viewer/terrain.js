// What the worker knows of a terrain, and which cells an eye may see: port of dav_gswt/terrain/assemble.py.
// Offsets are taken from the eye in double precision before the GPU sees them: kilometres out nothing shakes.

import { tileAt } from "./choice.js";
import { around, backToFront } from "./order.js";
import { largestOf } from "./records.js";

export const REACH = 48; // tile sides to the end of what is laid: 97 x 97 cells
export const NEAR = 0.1; // Gaussians nearer than this share of the eye floor are left out
const RIM = 3.33; // standard deviations at which an opaque Gaussian ends
const PAD = 2; // pixels by which the widening of splats reaches into the picture
const RING = 128; // cells along a side of the cache of surfaces: more than 2 REACH + 1
const COARSEST = 1 / 64; // by how much level distances may shrink to keep within the budget
const CLOSE = 3, PARTS = 8; // cells so near are measured at (PARTS + 1)^2 points: their levels follow from heights
const HALVINGS = 10; // steps of the search for that factor

/** Sizes and counts of a manifest in tables; `arrived` grows with its chunks. */
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
    switches: levels.map(({ distance }) => distance ?? Infinity), bands: levels.map(({ band }) => band ?? 0),
    z: [Math.min(...tiles.map((tile) => tile.z[0])), Math.max(...tiles.map((tile) => tile.z[1]))],
    near: NEAR * manifest.eye_floor, ring: createRing(),
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
  const at = (((j % RING) + RING) % RING) * RING + (((i % RING) + RING) % RING);
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
function measure({ ring, side, heights }, at) {
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

/**
 * What to draw: cells back to front with the levels lo to hi that have a weight in them, the factor `shrink` on the
 * level distances and the reach, all within a budget of Gaussians.
 *
 * Over the budget, levels and the far ground come nearer together (coarser tiles sooner, fewer tiles); where that is
 * not enough the farthest cells go.
 */
export function visible(terrain, camera, budget) {
  const farthest = REACH * terrain.side;
  let cells = inSight(terrain, camera, farthest);
  const { shrink, missing } = shrinkFor(terrain, cells, farthest, budget);
  let reach = farthest * Math.sqrt(shrink), count = 0;
  const kept = [];
  for (const cell of cells) {
    if (cell.nearest >= reach || !chooseLevels(terrain, cell, shrink)) continue;
    kept.push(cell);
    count += cell.count;
  }
  cells = kept;
  if (count > budget) {
    const nearestFirst = [...cells].sort((a, b) => a.nearest - b.nearest);
    let sum = 0;
    const most = nearestFirst.findIndex((cell, k) => k && (sum += cell.count) + nearestFirst[0].count > budget);
    const end = most < 0 ? Infinity : nearestFirst[most].nearest;
    cells = cells.filter((cell) => cell.nearest < end || cell === nearestFirst[0]);
    count = cells.reduce((all, cell) => all + cell.count, 0);
    reach = Math.min(reach, Math.max(end, terrain.near));
  }
  return { cells, count, reach, shrink, missing };
}

/** Cells within reach that the picture may show: never one left out of which anything shows. Back to front. */
function inSight(terrain, camera, reach) {
  const { side, heights, ring, z } = terrain, [x, y, height] = camera.eye;
  const i0 = Math.floor(x / side), j0 = Math.floor(y / side), planes = planesOf(camera, terrain.near);
  const overhang = RIM * terrain.largest, thin = Math.max(0, (RIM - 3) * terrain.largest);
  const most = heights.steepest * (0.5 * side + overhang) * Math.SQRT2, half = 0.5 * side, wide = half + overhang;
  const found = [];
  backToFront(REACH, (di, dj) => {
    const east = (i0 + di + 0.5) * side - x, north = (j0 + dj + 0.5) * side - y;
    const dx = Math.max(Math.abs(east) - half, 0), dy = Math.max(Math.abs(north) - half, 0);
    if (dx * dx + dy * dy >= reach * reach) return;
    const at = lookUp(terrain, i0 + di, j0 + dj), h = ring.h[at];
    const low = Math.max(h - most, heights.low) + z[0] - thin, high = Math.min(h + most, heights.high) + z[1] + thin;
    let up = 0.5 * (low + high) - height, tall = 0.5 * (high - low);
    let nearest = Math.hypot(dx, dy, Math.max(Math.abs(up) - tall, 0));
    if (nearest >= reach || outside(planes, east, north, up, wide, tall)) return;
    if (heights.steepest && Math.abs(di) <= CLOSE && Math.abs(dj) <= CLOSE) {
      measure(terrain, at);
      up = 0.5 * (ring.low[at] + ring.high[at] + z[0] + z[1]) - height;
      tall = 0.5 * (ring.high[at] - ring.low[at] + z[1] - z[0]) + thin;
      nearest = Math.hypot(dx, dy, Math.max(Math.abs(up) - tall, 0));
    }
    const farthest = Math.hypot(Math.abs(east) + half, Math.abs(north) + half, Math.abs(up) + tall);
    const chosen = { lo: 0, hi: 0, whole: false, lacking: 0, count: 0, direction: 0 };
    found.push({ di, dj, at, tile: ring.tile[at], close: around(di, dj), nearest, farthest, ...chosen });
  });
  return found;
}

/** The frustum's five planes through or before the eye: normal (inwards) and distance, four numbers each. */
function planesOf({ right, up, ahead, width, height, focal }, near) {
  const side = (axis, size, sign) => [...ahead.map((a, k) => a * (size / 2 + PAD) + sign * focal * axis[k]), 0];
  return [[...ahead, -near], side(right, width, 1), side(right, width, -1), side(up, height, 1), side(up, height, -1)];
}

/** Is the box wholly on the outer side of one plane? */
function outside(planes, east, north, up, wide, tall) {
  for (let k = 0; k < 5; k++) {
    const [a, b, c, d] = planes[k];
    if (a * east + b * north + c * up + d + (Math.abs(a) + Math.abs(b)) * wide + Math.abs(c) * tall < 0) return true;
  }
  return false;
}

/**
 * Set a cell's levels, lo to hi, and their count; where one of them has not arrived, one that has stands in for all
 * (`whole`: it does not fade), the next coarser first. Returns: is there anything to draw?
 */
function chooseLevels({ switches, bands, tiles, levels }, cell, shrink) {
  const { counts, arrived } = tiles[cell.tile];
  let lo = 0, hi = 0;
  while (lo < levels - 1 && cell.nearest > shrink * (switches[lo] + bands[lo])) lo += 1;
  for (hi = lo; hi < levels - 1 && cell.farthest >= shrink * (switches[hi] - bands[hi]);) hi += 1;
  const wanted = (2 << hi) - (1 << lo);
  cell.lacking = wanted & ~arrived;
  cell.whole = cell.lacking !== 0;
  if (cell.whole) {
    let level = lo;
    while (level < levels && !((arrived >> level) & 1)) level += 1;
    if (level === levels) for (level = lo - 1; level >= 0 && !((arrived >> level) & 1);) level -= 1;
    if (level < 0) return false;
    lo = hi = level;
  }
  cell.lo = lo;
  cell.hi = hi;
  cell.count = 0;
  for (let level = lo; level <= hi; level++) cell.count += counts[level];
  return true;
}

/** The largest factor s (at most 1) that keeps within the budget, and chunks (16 tile + level) that are lacking. */
function shrinkFor(terrain, cells, farthest, budget) {
  const cost = (shrink) => {
    const end = farthest * Math.sqrt(shrink);
    let sum = 0;
    for (const cell of cells) if (cell.nearest < end && chooseLevels(terrain, cell, shrink)) sum += cell.count;
    return sum;
  };
  const full = cost(1);
  const missing = new Set();
  for (const { tile, lacking } of cells) {
    for (let level = 0; lacking >> level; level++) if ((lacking >> level) & 1) missing.add(16 * tile + level);
  }
  if (full <= budget) return { shrink: 1, missing };
  let low = Math.log(COARSEST), high = 0;
  for (let k = 0; k < HALVINGS; k++) {
    const middle = (low + high) / 2;
    if (cost(Math.exp(middle)) <= budget) low = middle;
    else high = middle;
  }
  return { shrink: Math.exp(low), missing };
}
