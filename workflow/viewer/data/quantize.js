// Quantization of Gaussians to records: the same grid, steps and bytes as dav_gswt/bundle/encoding.py, for sets that
// the page itself converts to a bundle.

import { MAX_TURN, RECORD, TURN_STEPS } from "./layout.js";

/**
 * Gaussians in flat lists; turns: quaternions w x y z; paint: colour and opacity, 4 bytes each.
 *
 * @typedef {{ count: number, centres: Float32Array, logScales: Float32Array, turns: Float32Array,
 *   paint: Uint8Array | Uint8ClampedArray }} Gaussians
 * @typedef {import("./layout.js").Encoding} Encoding
 */

const PLACES = 65535, MIN_STEPS = 1024; // steps of the grid along an axis; fewest of them along a tile's side
const SIZES = 255; // steps of the logarithm of a deviation
const THINNEST = 1 / 64, WIDEST = 4; // bounds of axes: in pixels, in tile sides

/**
 * The finest grid that holds all these Gaussians; null: they spread too far.
 *
 * @param {Gaussians[]} sets @param {number} side
 * @param {number} pixel size of a pixel on the nearest ground in view
 * @returns {Encoding | null}
 */
export function fitEncoding(sets, side, pixel) {
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
  /** @param {number} v */
  const clip = (v) => Math.min(Math.max(v, Math.log(THINNEST * pixel)), Math.log(WIDEST * side));
  let west = Math.min(0, low[0], low[1]);
  const east = Math.max(side, high[0], high[1]);
  const steps = Math.floor(((PLACES - Number(west < 0)) * side) / (east - west));
  if (steps < MIN_STEPS) return null;
  const step = side / steps;
  west = west < 0 ? -Math.ceil(-west / step) * step : 0;
  return {
    origin: [west, west, low[2]], step: [step, step, (high[2] - low[2]) / PLACES],
    log_scale: [clip(least), (clip(largest) - clip(least)) / SIZES], sh_degree: 0,
  };
}

/**
 * Write Gaussians' records to the beginning of a buffer, and return that.
 *
 * @param {ArrayBuffer} buffer @param {Gaussians} gaussians @param {Encoding} encoding
 */
export function writeRecords(buffer, { count, centres, logScales, turns, paint }, encoding) {
  const { origin, step, log_scale: [least, rise] } = encoding;
  const halves = new Uint16Array(buffer, 0, (count * RECORD) / 2), bytes = new Uint8Array(buffer, 0, count * RECORD);
  /** @param {number} v @param {number} most */
  const quantize = (v, most) => Math.min(Math.max(roundEven(v), 0), most);
  for (let k = 0; k < count; k++) {
    const { turn, axes } = leastTurn([...turns.subarray(4 * k, 4 * k + 4)]), at = RECORD * k;
    for (let n = 0; n < 3; n++) {
      halves[8 * k + n] = quantize((centres[3 * k + n] - origin[n]) / (step[n] || 1), PLACES);
      bytes[at + 6 + n] = quantize((logScales[3 * k + axes[n]] - least) / (rise || 1), SIZES);
      const steps = roundEven((turn[n + 1] * TURN_STEPS) / MAX_TURN);
      bytes[at + 9 + n] = TURN_STEPS + Math.min(Math.max(steps, -TURN_STEPS), TURN_STEPS);
    }
    bytes.set(paint.subarray(4 * k, 4 * k + 4), at + 12);
  }
  return buffer;
}

/** Round; halves to the even number. @param {number} v */
function roundEven(v) {
  const down = Math.floor(v);
  return v - down === 0.5 ? down + (down & 1) : Math.round(v);
}

/**
 * The unit quaternion (w > 0) of the smallest rotation that gives the same ellipsoid, and which old axis each new one is.
 *
 * @param {number[]} q
 */
function leastTurn(q) {
  const long = Math.hypot(...q);
  let best = CUBE[0], most = -1;
  for (const one of CUBE) {
    const [w, x, y, z] = one.turn, real = Math.abs(q[0] * w - q[1] * x - q[2] * y - q[3] * z) / long;
    if (real > most + 1e-12) [best, most] = [one, real];
  }
  const turn = multiply(q, best.turn), sign = (turn[0] < 0 ? -1 : 1) / long;
  return { turn: turn.map((v) => sign * v), axes: best.axes };
}

/** Product of quaternions. @param {number[]} p @param {number[]} q */
function multiply([a, b, c, d], [e, f, g, h]) {
  return [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
}

/** The 24 rotations of a cube: all products of a quarter turn about each of two axes. */
const CUBE = (() => {
  const quarter = Math.SQRT1_2, steps = [[quarter, quarter, 0, 0], [quarter, 0, quarter, 0]];
  const rotations = [[1, 0, 0, 0]];
  /** @param {number[]} q */
  const isKnown = (q) => rotations.some((p) => Math.abs(p.reduce((sum, v, n) => sum + v * q[n], 0)) > 0.99);
  for (const one of rotations) { // grows while it is walked through
    for (const step of steps) if (!isKnown(multiply(one, step))) rotations.push(multiply(one, step));
  }
  return rotations.map((turn) => ({ turn, axes: [0, 1, 2].map((axis) => rotatedAxis(turn, axis)) }));
})();

/** The axis to which a rotation of the cube brings one of the three. @param {number[]} turn @param {number} axis */
function rotatedAxis(turn, axis) {
  const [w, x, y, z] = turn, unit = [0, 0, 0, 0];
  unit[axis + 1] = 1;
  const [, ...to] = multiply(multiply(turn, unit), [w, -x, -y, -z]).map(Math.abs);
  return to.indexOf(Math.max(...to));
}
