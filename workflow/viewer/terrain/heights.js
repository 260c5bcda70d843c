// Height fields: height and slope of the surface at any point, in double precision and as input of the shaders.
// The same numbers as dav_gswt/terrain/heights.py; tests/golden/heights.json holds both to it.

import { hashCell } from "./choice.js";
import { createSphere } from "./sphere.js";

const HILLS = 3; // axis of the hash of octave 0, after west, south and centre; octave k uses HILLS + k
const GAIN = 0.4; // height of an octave over that of the one twice as wide
export const SHIFT = [0.37, 0.71]; // of each octave against the last, in its own cells
const STEEPEST = 2.75; // upper bound of the slope of the noise, per cell
export const MAX_OCTAVES = 12;

/**
 * A manifest's `heights` entry.
 *
 * @typedef {{ kind: "flat" }} FlatEntry
 * @typedef {{ kind: "hills", height: number, wavelength: number, octaves: number, salt: number }} HillsEntry
 * @typedef {{ kind: "image", file: string, bytes: number, sha256?: string, rows: number, columns: number,
 *   width: number }} ImageEntry
 * @typedef {FlatEntry | HillsEntry | ImageEntry | import("./sphere.js").SphereEntry} HeightsEntry
 *
 * What all height fields have: `at` gives [height, slope by x, slope by y]; `low`, `high` and `steepest` are bounds.
 * @typedef {{ low: number, high: number, steepest: number,
 *   at: (x: number, y: number) => [number, number, number] }} Bounds
 *
 * `under`, for the GPU: of each octave (of the image) the cell (pixel) under the eye and the place in it.
 * @typedef {(x: number, y: number) => { cells: Int32Array, places: Float32Array }} Under
 * @typedef {Bounds & { kind: "flat" }} FlatSurface
 * @typedef {Bounds & { kind: "hills", amplitudes: number[], scales: number[], salt: number, under: Under }} Hills
 * @typedef {Bounds & { kind: "image", rows: number, columns: number, perUnit: number, pixels: Float32Array,
 *   under: Under }} HeightMap
 * @typedef {FlatSurface | Hills | HeightMap | import("./sphere.js").Sphere} HeightField
 */

/**
 * The surface of a manifest's `heights` entry.
 *
 * @param {HeightsEntry} [entry]
 * @param {Float32Array | null} [pixels] of a height map, rows from the north
 * @returns {HeightField}
 */
export function createHeights(entry = { kind: "flat" }, pixels = null) {
  if (entry.kind === "hills") return createHills(entry);
  if (entry.kind === "sphere") return createSphere(entry);
  if (entry.kind === "image") {
    if (!pixels) throw new TypeError("a height map needs its pixels");
    return createHeightMap(entry, pixels);
  }
  if (entry.kind === "flat") return { kind: "flat", low: 0, high: 0, steepest: 0, at: () => [0, 0, 0] };
  throw new TypeError("no surface of this kind");
}

/** @param {HillsEntry} entry @returns {Hills} */
function createHills({ height, wavelength, octaves, salt }) {
  const shares = [1];
  for (let k = 1; k < octaves; k++) shares.push(shares[k - 1] * GAIN);
  const sum = shares.reduce((a, b) => a + b, 0);
  const amplitudes = shares.map((share) => (height * share) / sum);
  const scales = amplitudes.map((_, k) => 2 ** k / wavelength);
  const rise = amplitudes.reduce((all, a, k) => all + a * 2 ** k, 0);
  const noise = [0, 0, 0];
  return {
    kind: "hills", amplitudes, scales, salt, low: -height, high: height, steepest: (STEEPEST * rise) / wavelength,
    at(x, y) {
      let h = 0, byX = 0, byY = 0;
      for (let k = 0; k < amplitudes.length; k++) {
        const cells = scales[k];
        gradientNoise(x * cells + k * SHIFT[0], y * cells + k * SHIFT[1], HILLS + k, salt, noise);
        h += amplitudes[k] * noise[0];
        byX += amplitudes[k] * cells * noise[1];
        byY += amplitudes[k] * cells * noise[2];
      }
      return [h, byX, byY];
    },
    under(x, y) {
      const cells = new Int32Array(2 * MAX_OCTAVES), places = new Float32Array(2 * MAX_OCTAVES);
      for (let k = 0; k < amplitudes.length; k++) {
        [x, y].forEach((v, axis) => {
          const u = v * scales[k] + k * SHIFT[axis], cell = Math.floor(u);
          cells[2 * k + axis] = cell | 0; // modulo 2^32
          places[2 * k + axis] = u - cell;
        });
      }
      return { cells, places };
    },
  };
}

/**
 * Gradient noise and its derivatives, x and y in cells.
 *
 * @param {number} x @param {number} y @param {number} axis @param {number} salt
 * @param {number[]} out value, derivative by x, derivative by y
 */
function gradientNoise(x, y, axis, salt, out) {
  const i = Math.floor(x), j = Math.floor(y), u = x - i, v = y - j;
  const fadeX = fade(u), fadeY = fade(v), turnX = fadeSlope(u), turnY = fadeSlope(v);
  let value = 0, byX = 0, byY = 0;
  for (let b = 0; b < 2; b++) {
    for (let a = 0; a < 2; a++) {
      const bits = hashCell(i + a, j + b, axis, salt);
      const east = (bits & 0xffff) / 32767.5 - 1, north = (bits >>> 16) / 32767.5 - 1;
      const plane = east * (u - a) + north * (v - b);
      const across = a ? fadeX : 1 - fadeX, along = b ? fadeY : 1 - fadeY, weight = across * along;
      value += weight * plane;
      byX += weight * east + (a ? turnX : -turnX) * along * plane;
      byY += weight * north + across * (b ? turnY : -turnY) * plane;
    }
  }
  out[0] = value;
  out[1] = byX;
  out[2] = byY;
}

/**
 * Gradient noise without its derivatives, x and y in cells; remembers the gradients of the last cell.
 *
 * @param {number} axis @param {number} salt
 * @returns {(x: number, y: number) => number}
 */
export function createNoise(axis, salt) {
  const gradients = new Float64Array(8);
  let east = NaN, north = NaN; // the cell of the gradients
  return (x, y) => {
    const i = Math.floor(x), j = Math.floor(y), u = x - i, v = y - j, across = fade(u), along = fade(v);
    if (i !== east || j !== north) {
      for (let k = 0; k < 4; k++) {
        const bits = hashCell(i + (k & 1), j + (k >> 1), axis, salt);
        gradients[2 * k] = (bits & 0xffff) / 32767.5 - 1;
        gradients[2 * k + 1] = (bits >>> 16) / 32767.5 - 1;
      }
      east = i;
      north = j;
    }
    return (1 - across) * (1 - along) * (gradients[0] * u + gradients[1] * v)
      + across * (1 - along) * (gradients[2] * (u - 1) + gradients[3] * v)
      + (1 - across) * along * (gradients[4] * u + gradients[5] * (v - 1))
      + across * along * (gradients[6] * (u - 1) + gradients[7] * (v - 1));
  };
}

/** @param {number} t */
export const fade = (t) => t * t * t * (t * (6 * t - 15) + 10);
/** @param {number} t */
const fadeSlope = (t) => 30 * t * t * (t * (t - 2) + 1);

/** @param {ImageEntry} entry @param {Float32Array} pixels @returns {HeightMap} */
function createHeightMap({ rows, columns, width }, pixels) {
  const perUnit = columns / width;
  // the pixel under the eye as a small integer: beyond the map it repeats
  /** @param {number} u @param {number} n */
  const pixelUnder = (u, n) => {
    const pixel = Math.floor(u);
    return [pixel % (2 * n), u - pixel];
  };
  return {
    kind: "image", rows, columns, perUnit, pixels, ...boundsOf(pixels, rows, columns, perUnit),
    at(x, y) {
      const [i, across, turnX] = splineWeights(x * perUnit + 0.5 * columns);
      const [j, along, turnY] = splineWeights(0.5 * rows - y * perUnit);
      let h = 0, byX = 0, byY = 0;
      for (let b = 0; b < 3; b++) {
        const row = mirrorIndex(j + b - 1, rows) * columns;
        for (let a = 0; a < 3; a++) {
          const value = pixels[row + mirrorIndex(i + a - 1, columns)];
          h += value * across[a] * along[b];
          byX += value * turnX[a] * along[b];
          byY -= value * across[a] * turnY[b]; // rows go south
        }
      }
      return [h, byX * perUnit, byY * perUnit];
    },
    under(x, y) {
      const [i, u] = pixelUnder(x * perUnit + 0.5 * columns, columns);
      const [j, v] = pixelUnder(0.5 * rows - y * perUnit, rows);
      return { cells: new Int32Array([i, j]), places: new Float32Array([u, v]) };
    },
  };
}

/** Index of an image's n pixels for any index. @param {number} index @param {number} n */
function mirrorIndex(index, n) {
  const k = ((index % (2 * n)) + 2 * n) % (2 * n);
  return k < n ? k : 2 * n - 1 - k;
}

/** @param {Float32Array} pixels @param {number} rows @param {number} columns @param {number} perUnit */
function boundsOf(pixels, rows, columns, perUnit) {
  let low = Infinity, high = -Infinity, dx = 0, dy = 0;
  for (let r = 0, k = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++, k++) {
      low = Math.min(low, pixels[k]);
      high = Math.max(high, pixels[k]);
      if (c) dx = Math.max(dx, Math.abs(pixels[k] - pixels[k - 1]));
      if (r) dy = Math.max(dy, Math.abs(pixels[k] - pixels[k - columns]));
    }
  }
  return { low, high, steepest: Math.hypot(dx, dy) * perUnit };
}

/**
 * The pixel under a point, the weights of it and its two neighbours in a quadratic B-spline, and their derivatives.
 *
 * @param {number} u
 * @returns {[number, number[], number[]]}
 */
function splineWeights(u) {
  const pixel = Math.floor(u), t = u - pixel - 0.5, before = 0.5 - t, after = 0.5 + t;
  return [pixel, [0.5 * before * before, 0.75 - t * t, 0.5 * after * after], [-before, -2 * t, after]];
}
