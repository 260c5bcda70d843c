// Which cells an eye may see: port of dav_gswt/terrain/assemble.py.
// Offsets are taken from the eye in double precision before the GPU sees them: kilometres out nothing shakes.

import { around, backToFront } from "./order.js";
import { lookUp, measure, REACH } from "./terrain.js";

export const RIM = 3.33; // standard deviations at which an opaque Gaussian ends
const PAD = 2; // pixels by which the widening of splats reaches into the picture
const CLOSE = 3; // cells so near are measured: their levels follow from heights
const SLACK = 1e-6; // cells by which a row is looked at further than it need be: more than rounding

/**
 * Cells within reach that the picture may show: never one left out of which anything shows. Back to front.
 * The next call fills the same cells again: nothing is allocated for a view.
 */
export function inSight(terrain, camera, reach) {
  const { side, heights, ring, z, cells } = terrain, [x, y, height] = camera.eye;
  const i0 = Math.floor(x / side), j0 = Math.floor(y / side), planes = planesOf(camera, terrain.near);
  const overhang = RIM * terrain.largest, thin = Math.max(0, (RIM - 3) * terrain.largest);
  const most = heights.steepest * (0.5 * side + overhang) * Math.SQRT2, half = 0.5 * side, wide = half + overhang;
  const lowest = heights.low + z[0] - thin - height, highest = heights.high + z[1] + thin - height;
  const rows = rowsOf(planes, { side, x, y, reach, wide, lowest, highest }), { first, last } = rows;
  let n = 0;
  backToFront(REACH, (di, dj) => {
    if (di < first[dj + REACH] || di > last[dj + REACH]) return;
    const east = (i0 + di + 0.5) * side - x, north = (j0 + dj + 0.5) * side - y;
    const dx = Math.max(Math.abs(east) - half, 0), dy = Math.max(Math.abs(north) - half, 0);
    if (dx * dx + dy * dy >= reach * reach) return;
    const at = lookUp(terrain, i0 + di, j0 + dj), h = ring.h[at];
    const low = Math.max(h - most, heights.low) + z[0] - thin, high = Math.min(h + most, heights.high) + z[1] + thin;
    let up = 0.5 * (low + high) - height, tall = 0.5 * (high - low);
    let nearest = length(dx, dy, Math.max(Math.abs(up) - tall, 0));
    if (nearest >= reach || outside(planes, east, north, up, wide, tall)) return;
    if (heights.steepest && Math.abs(di) <= CLOSE && Math.abs(dj) <= CLOSE) {
      measure(terrain, at);
      up = 0.5 * (ring.low[at] + ring.high[at] + z[0] + z[1]) - height;
      tall = 0.5 * (ring.high[at] - ring.low[at] + z[1] - z[0]) + thin;
      nearest = length(dx, dy, Math.max(Math.abs(up) - tall, 0));
    }
    const cell = (cells[n++] ??= blank());
    cell.di = di;
    cell.dj = dj;
    cell.at = at;
    cell.tile = ring.tile[at];
    cell.close = around(di, dj);
    cell.nearest = nearest;
    cell.farthest = length(Math.abs(east) + half, Math.abs(north) + half, Math.abs(up) + tall);
  });
  return cells.slice(0, n);
}

const length = (x, y, z) => Math.sqrt(x * x + y * y + z * z);
const blank = () => ({
  di: 0, dj: 0, at: 0, tile: 0, close: false, nearest: 0.5, farthest: 0.5,
  lo: 0, hi: 0, whole: false, lacking: 0, count: 0, direction: 0,
});

/**
 * Of each row of cells the first and the last that may be in sight, wherever between its bounds the surface lies: most
 * cells of the window are outside, and are not looked at one by one.
 */
function rowsOf(planes, { side, x, y, reach, wide, lowest, highest }) {
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

/** The frustum's five planes before or through the eye: normal (inwards) and distance, four numbers each. */
export function planesOf({ right, up, ahead, width, height, focal }, near) {
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
