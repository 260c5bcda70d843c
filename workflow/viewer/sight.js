// Which cells an eye may see: port of dav_gswt/terrain/assemble.py.
// Offsets are taken from the eye in double precision before the GPU sees them: kilometres out nothing shakes.

import { around, backToFront } from "./order.js";
import { lookUp, measure, REACH } from "./terrain.js";

const RIM = 3.33; // standard deviations at which an opaque Gaussian ends
const PAD = 2; // pixels by which the widening of splats reaches into the picture
const CLOSE = 3; // cells so near are measured: their levels follow from heights

/** Cells within reach that the picture may show: never one left out of which anything shows. Back to front. */
export function inSight(terrain, camera, reach) {
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
