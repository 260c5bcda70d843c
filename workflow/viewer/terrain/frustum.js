// Frustum culling: the cells that an eye may see. Port of dav_gswt/terrain/visibility.py.
// Offsets are taken from the eye in double precision before the GPU sees them, so nothing shakes kilometres out.

import { boundHeights, lookUpCell, REACH } from "./cells.js";
import { inNearBlock, visitBackToFront } from "./draw_order.js";

/**
 * A cell in view. di, dj: from the eye's cell; at: index in the cell cache; nearest, farthest: bounds of the distances
 * of its Gaussians; tile: of the first material; tiles: of all that may show; border: where several materials meet;
 * things: objects whose feet are in it; arrived: bits of the levels at hand; lo to hi: its levels; whole: one level stands
 * in for missing ones and does not fade; missing: bits of the levels that have not arrived; count: of its Gaussians;
 * direction: of its pre-sorted order; spot: where it lies on a sphere, of which di and dj are the column and the row then.
 * @typedef {{ di: number, dj: number, at: number, tile: number, tiles: number[],
 *   border: import("./cells.js").Border | null, things: import("./scatter.js").Thing[], close: boolean,
 *   nearest: number, farthest: number, arrived: number, lo: number, hi: number, whole: boolean, missing: number,
 *   count: number, direction: number, spot: import("./sphere_cells.js").Spot | null }} Cell
 *
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables
 */

export const RIM = 3.33; // standard deviations at which an opaque Gaussian ends
const PAD = 2; // pixels by which the dilation of splats reaches into the picture
const CLOSE = 3; // cells so near have their heights bounded, as their levels depend on them
const SLACK = 1e-6; // cells: more than rounding can move the ends of a row

/**
 * Cells within reach that the picture may show, back to front; never one left out of which anything shows.
 * The next call reuses the same cell objects, so nothing is allocated for a view.
 *
 * @param {TerrainTables} terrain @param {Camera} camera @param {number} reach
 * @returns {Cell[]}
 */
export function cellsInFrustum(terrain, camera, reach) {
  const { side, heights, cache, cells } = terrain, [x, y, height] = camera.eye, { z, widest } = spanOf(terrain);
  const i0 = Math.floor(x / side), j0 = Math.floor(y / side), planes = frustumPlanes(camera, terrain.near);
  const overhang = Math.max(RIM * terrain.largest, widest), slack = heights.steepest * widest;
  const most = heights.steepest * (0.5 * side + overhang) * Math.SQRT2, half = 0.5 * side, wide = half + overhang;
  const lowest = heights.low + z[0] - height, highest = heights.high + z[1] - height;
  const { first, last } = rowRanges(planes, { side, x, y, reach, wide, lowest, highest });
  let n = 0;
  visitBackToFront(REACH, (di, dj) => {
    if (di < first[dj + REACH] || di > last[dj + REACH]) return;
    const east = (i0 + di + 0.5) * side - x, north = (j0 + dj + 0.5) * side - y;
    const dx = Math.max(Math.abs(east) - half, 0), dy = Math.max(Math.abs(north) - half, 0);
    if (dx * dx + dy * dy >= reach * reach) return;
    const at = lookUpCell(terrain, i0 + di, j0 + dj), h = cache.h[at];
    const low = Math.max(h - most, heights.low) + z[0], high = Math.min(h + most, heights.high) + z[1];
    let up = 0.5 * (low + high) - height, tall = 0.5 * (high - low);
    let nearest = length(dx, dy, Math.max(Math.abs(up) - tall, 0));
    if (nearest >= reach || isOutside(planes, east, north, up, wide, tall)) return;
    if (heights.steepest && Math.abs(di) <= CLOSE && Math.abs(dj) <= CLOSE) {
      boundHeights(terrain, at);
      up = 0.5 * (cache.low[at] + cache.high[at] + z[0] + z[1]) - height;
      tall = 0.5 * (cache.high[at] - cache.low[at] + z[1] - z[0]) + slack;
      nearest = length(dx, dy, Math.max(Math.abs(up) - tall, 0));
    }
    if (n === cells.length) cells.push(blankCell());
    const cell = cells[n++];
    cell.di = di;
    cell.dj = dj;
    cell.at = at;
    cell.tile = cache.tile[at];
    cell.tiles = cache.tiles[at];
    cell.border = cache.border[at];
    cell.things = cache.things[at];
    cell.close = inNearBlock(di, dj);
    cell.nearest = nearest;
    cell.farthest = length(Math.abs(east) + half, Math.abs(north) + half, Math.abs(up) + tall);
  });
  return cells.slice(0, n);
}

/**
 * Range of the heights of all Gaussians above the surface, and the largest extent of an object from its foot.
 *
 * @param {TerrainTables} terrain
 */
function spanOf({ z: [low, high], objects, most }) {
  let widest = 0;
  for (const { ground, extent } of objects) {
    widest = Math.max(widest, most * extent);
    low = Math.min(low, ground - most * extent);
    high = Math.max(high, ground + most * extent);
  }
  return { z: [low, high], widest };
}

/** @param {number} x @param {number} y @param {number} z */
const length = (x, y, z) => Math.sqrt(x * x + y * y + z * z);
/** @returns {Cell} */
export const blankCell = () => ({
  di: 0, dj: 0, spot: null, at: 0, tile: 0, tiles: [], border: null, things: [], close: false,
  nearest: 0.5, farthest: 0.5, arrived: 0,
  lo: 0, hi: 0, whole: false, missing: 0, count: 0, direction: 0,
});

/**
 * First and last cell of each row that may be in view, for any height of the surface within its bounds: most cells of
 * the window are culled by row.
 *
 * @param {number[][]} planes
 * @param {{ side: number, x: number, y: number, reach: number, wide: number, lowest: number, highest: number }} window
 */
function rowRanges(planes, { side, x, y, reach, wide, lowest, highest }) {
  const first = new Int32Array(2 * REACH + 1), last = new Int32Array(2 * REACH + 1).fill(-REACH - 1);
  const partX = x / side - Math.floor(x / side), partY = y / side - Math.floor(y / side);
  for (let dj = -REACH; dj <= REACH; dj++) {
    const north = (dj + 0.5 - partY) * side, beside = Math.max(Math.abs(north) - 0.5 * side, 0);
    if (beside >= reach) continue;
    let most = 0.5 * side + Math.sqrt(reach * reach - beside * beside), least = -most;
    for (const [a, b, c, d] of planes) {
      const rest = b * north + d + (Math.abs(a) + Math.abs(b)) * wide + Math.max(c * lowest, c * highest);
      if (a > 0) least = Math.max(least, -rest / a);
      else if (a < 0) most = Math.min(most, -rest / a);
      else if (rest < 0) most = -Infinity;
    }
    first[dj + REACH] = Math.max(-REACH, Math.ceil(least / side + partX - 0.5 - SLACK));
    last[dj + REACH] = Math.max(-REACH - 1, Math.min(REACH, Math.floor(most / side + partX - 0.5 + SLACK)));
  }
  return { first, last };
}

/**
 * Near, left, right, bottom and top plane: inward normal and distance, four numbers each.
 *
 * @param {Camera} camera @param {number} near
 * @returns {number[][]}
 */
export function frustumPlanes({ right, up, ahead, width, height, focal }, near) {
  /** @param {number[]} axis @param {number} size @param {number} sign */
  const side = (axis, size, sign) => [...ahead.map((a, k) => a * (size / 2 + PAD) + sign * focal * axis[k]), 0];
  return [[...ahead, -near], side(right, width, 1), side(right, width, -1), side(up, height, 1), side(up, height, -1)];
}

/**
 * A function that tells whether a ball about a point, from the eye, is wholly outside one plane.
 *
 * @param {number[][]} planes
 */
export function createBallTest(planes) {
  const norms = planes.map(([a, b, c]) => Math.hypot(a, b, c));
  /** @param {number[]} centre @param {number} radius */
  return (centre, radius) => {
    for (let k = 0; k < planes.length; k++) {
      const plane = planes[k], inside = plane[0] * centre[0] + plane[1] * centre[1] + plane[2] * centre[2] + plane[3];
      if (inside < -radius * norms[k]) return true;
    }
    return false;
  };
}

/**
 * Is a box (centre from the eye, half extents) wholly outside one plane?
 *
 * @param {number[][]} planes @param {number} east @param {number} north @param {number} up
 * @param {number} wide @param {number} tall
 */
function isOutside(planes, east, north, up, wide, tall) {
  for (let k = 0; k < 5; k++) {
    const [a, b, c, d] = planes[k];
    if (a * east + b * north + c * up + d + (Math.abs(a) + Math.abs(b)) * wide + Math.abs(c) * tall < 0) return true;
  }
  return false;
}
