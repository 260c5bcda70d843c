// Gaussians rounded to records: the same grid, steps and bytes as dav_gswt/bundle/encoding.py, for sets that the page
// itself turns into a bundle. Gaussians are { count, centres, logScales, turns (w x y z), paint (4 bytes) }, in lists.

import { RECORD, STEEPEST, TURNS } from "./records.js";

const PLACES = 65535, LEAST = 1024; // steps of the grid along an axis, and of them a tile's side is wide
const SIZES = 255; // steps of a logarithm of a deviation
const SLIGHTEST = 1 / 64, WIDEST = 4; // shorter axes are cut to so many pixels, longer ones to so many tile sides

/** The finest grid that holds all these Gaussians; null: they spread too far. pixel: on the nearest ground in sight. */
export function encodingOf(sets, side, pixel) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  let least = Infinity, largest = -Infinity;
  for (const { centres, logScales } of sets) {
    for (let k = 0; k < centres.length; k++) {
      low[k % 3] = Math.min(low[k % 3], centres[k]);
      high[k % 3] = Math.max(high[k % 3], centres[k]);
      least = Math.min(least, logScales[k]);
      largest = Math.max(largest, logScales[k]);
    }
  }
  const clipped = (v) => Math.min(Math.max(v, Math.log(SLIGHTEST * pixel)), Math.log(WIDEST * side));
  let west = Math.min(0, low[0], low[1]);
  const east = Math.max(side, high[0], high[1]);
  const many = Math.floor(((PLACES - Number(west < 0)) * side) / (east - west));
  if (many < LEAST) return null;
  const step = side / many;
  west = west < 0 ? -Math.ceil(-west / step) * step : 0;
  return {
    origin: [west, west, low[2]], step: [step, step, (high[2] - low[2]) / PLACES],
    log_scale: [clipped(least), (clipped(largest) - clipped(least)) / SIZES], sh_degree: 0,
  };
}

/** Write Gaussians' records to the beginning of a chunk. */
export function writeRecords(buffer, { count, centres, logScales, turns, paint }, encoding) {
  const { origin, step, log_scale: [least, rise] } = encoding;
  const halves = new Uint16Array(buffer, 0, (count * RECORD) / 2), bytes = new Uint8Array(buffer, 0, count * RECORD);
  const within = (v, most) => Math.min(Math.max(even(v), 0), most);
  for (let k = 0; k < count; k++) {
    const { turn, axes } = smallest(turns.subarray(4 * k, 4 * k + 4)), at = RECORD * k;
    for (let n = 0; n < 3; n++) {
      halves[8 * k + n] = within((centres[3 * k + n] - origin[n]) / (step[n] || 1), PLACES);
      bytes[at + 6 + n] = within((logScales[3 * k + axes[n]] - least) / (rise || 1), SIZES);
      bytes[at + 9 + n] = TURNS + Math.min(Math.max(even((turn[n + 1] * TURNS) / STEEPEST), -TURNS), TURNS);
    }
    bytes.set(paint.subarray(4 * k, 4 * k + 4), at + 12);
  }
}

/** Round; halves to the even number. */
function even(v) {
  const down = Math.floor(v);
  return v - down === 0.5 ? down + (down & 1) : Math.round(v);
}

/** The unit quaternion, w > 0, of the same ellipsoid turned least, and of each new axis which old one it is. */
function smallest(q) {
  const long = Math.hypot(...q);
  let best = CUBE[0], most = -1;
  for (const one of CUBE) {
    const [w, x, y, z] = one.turn, real = Math.abs(q[0] * w - q[1] * x - q[2] * y - q[3] * z) / long;
    if (real > most + 1e-12) [best, most] = [one, real];
  }
  const turn = product(q, best.turn), sign = (turn[0] < 0 ? -1 : 1) / long;
  return { turn: turn.map((v) => sign * v), axes: best.axes };
}

function product([a, b, c, d], [e, f, g, h]) {
  return [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
}

/** The 24 rotations of a cube: a quarter turn about each of two axes, and all that they make together. */
const CUBE = (() => {
  const quarter = Math.SQRT1_2, steps = [[quarter, quarter, 0, 0], [quarter, 0, quarter, 0]];
  const found = [[1, 0, 0, 0]];
  const known = (q) => found.some((p) => Math.abs(p.reduce((sum, v, n) => sum + v * q[n], 0)) > 0.99);
  for (const one of found) for (const step of steps) if (!known(product(one, step))) found.push(product(one, step));
  return found.map((turn) => ({ turn, axes: [0, 1, 2].map((axis) => axisOf(turn, axis)) }));
})();

/** To which axis a rotation of the cube brings one of the three. */
function axisOf(turn, axis) {
  const [w, x, y, z] = turn, unit = [0, 0, 0, 0];
  unit[axis + 1] = 1;
  const [, ...to] = product(product(turn, unit), [w, -x, -y, -z]).map(Math.abs);
  return to.indexOf(Math.max(...to));
}
