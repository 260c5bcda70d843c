// Height fields: where the surface lies and how steep it is, for any point of the world, in doubles and on the GPU.
// The same numbers as dav_gswt/terrain/heights.py; tests/golden/heights.json holds both to it.

import { hashed } from "./choice.js";

const HILLS = 3; // what a hash is for, after west, south and centre: the gradient of octave 0, 1, ...
const GAIN = 0.4; // height of an octave over that of the one twice as wide
const SHIFT = [0.37, 0.71]; // of each octave against the last, in its own cells
const STEEPEST = 2.75; // slope of the noise, per cell
export const MOST_OCTAVES = 12;

/**
 * The surface of a manifest's `heights` entry; pixels: of an image, rows from the north.
 * `at(x, y)` gives [height, slope by x, slope by y]; `low`, `high` and `steepest` bound it everywhere.
 */
export function createHeights(entry = { kind: "flat" }, pixels = null) {
  if (entry.kind === "hills") return hills(entry);
  if (entry.kind === "image") return relief(entry, pixels);
  return { kind: "flat", low: 0, high: 0, steepest: 0, at: () => [0, 0, 0] };
}

function hills({ height, wavelength, octaves, salt }) {
  const shares = [1];
  for (let k = 1; k < octaves; k++) shares.push(shares[k - 1] * GAIN);
  const sum = shares.reduce((a, b) => a + b, 0);
  const amplitudes = shares.map((share) => (height * share) / sum);
  const scales = amplitudes.map((_, k) => 2 ** k / wavelength);
  const rise = amplitudes.reduce((all, a, k) => all + a * 2 ** k, 0);
  const out = [0, 0, 0];
  return {
    kind: "hills", amplitudes, scales, salt, low: -height, high: height, steepest: (STEEPEST * rise) / wavelength,
    at(x, y) {
      let h = 0, by_x = 0, by_y = 0;
      for (let k = 0; k < amplitudes.length; k++) {
        const cells = scales[k];
        noise(x * cells + k * SHIFT[0], y * cells + k * SHIFT[1], HILLS + k, salt, out);
        h += amplitudes[k] * out[0];
        by_x += amplitudes[k] * cells * out[1];
        by_y += amplitudes[k] * cells * out[2];
      }
      return [h, by_x, by_y];
    },
    /** For the GPU: of each octave the cell under the eye (modulo 2^32) and the place in it. */
    under(x, y) {
      const cells = new Int32Array(2 * MOST_OCTAVES), places = new Float32Array(2 * MOST_OCTAVES);
      for (let k = 0; k < amplitudes.length; k++) {
        [x, y].forEach((v, axis) => {
          const u = v * scales[k] + k * SHIFT[axis], cell = Math.floor(u);
          cells[2 * k + axis] = cell | 0;
          places[2 * k + axis] = u - cell;
        });
      }
      return { cells, places };
    },
  };
}

function noise(x, y, axis, salt, out) {
  const i = Math.floor(x), j = Math.floor(y), u = x - i, v = y - j;
  const fadeX = fade(u), fadeY = fade(v), turnX = turn(u), turnY = turn(v);
  let value = 0, byX = 0, byY = 0;
  for (let b = 0; b < 2; b++) {
    for (let a = 0; a < 2; a++) {
      const bits = hashed(i + a, j + b, axis, salt);
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

const fade = (t) => t * t * t * (t * (6 * t - 15) + 10);
const turn = (t) => 30 * t * t * (t * (t - 2) + 1);

function relief({ rows, columns, width, beyond }, pixels) {
  const perUnit = columns / width, mirrored = beyond !== "clamp";
  const inside = (index, n) => {
    if (!mirrored) return Math.min(Math.max(index, 0), n - 1);
    const k = ((index % (2 * n)) + 2 * n) % (2 * n);
    return k < n ? k : 2 * n - 1 - k;
  };
  let low = Infinity, high = -Infinity, dx = 0, dy = 0;
  for (let r = 0, k = 0; r < rows; r++) {
    for (let c = 0; c < columns; c++, k++) {
      low = Math.min(low, pixels[k]);
      high = Math.max(high, pixels[k]);
      if (c) dx = Math.max(dx, Math.abs(pixels[k] - pixels[k - 1]));
      if (r) dy = Math.max(dy, Math.abs(pixels[k] - pixels[k - columns]));
    }
  }
  // the pixel under the eye, as a small integer: beyond the map it repeats, or stays at the border
  const pixelUnder = (u, n) => {
    const pixel = Math.floor(u);
    return [mirrored ? pixel % (2 * n) : Math.min(Math.max(pixel, -(2 ** 24)), 2 ** 24), u - pixel];
  };
  return {
    kind: "image", rows, columns, perUnit, mirrored, pixels, low, high, steepest: Math.hypot(dx, dy) * perUnit,
    at(x, y) {
      const [i, across, turnX] = taps(x * perUnit + 0.5 * columns), [j, along, turnY] = taps(0.5 * rows - y * perUnit);
      let h = 0, byX = 0, byY = 0;
      for (let b = 0; b < 3; b++) {
        const row = inside(j + b - 1, rows) * columns;
        for (let a = 0; a < 3; a++) {
          const value = pixels[row + inside(i + a - 1, columns)];
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

function taps(u) {
  const pixel = Math.floor(u), t = u - pixel - 0.5, before = 0.5 - t, after = 0.5 + t;
  return [pixel, [0.5 * before * before, 0.75 - t * t, 0.5 * after * after], [-before, -2 * t, after]];
}
