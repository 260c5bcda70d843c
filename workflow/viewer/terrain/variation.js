// Variation of the place: large-scale light and dark, as noise of the place that is added to colours.
// And jitter of the classes: fine noise that frays the borders of materials, see classes.js.
// The same numbers as dav_gswt/terrain/variation.py and classes.py; tests/golden/heights.json holds both to it.

import { hashCell } from "./choice.js";
import { createNoise, fade, SHIFT } from "./heights.js";

export const VARIATION = 104; // axis of the hash: wave k uses VARIATION + k
const TURN = [0.8, 0.6]; // cosine and sine by which each wave is turned against the last
export const MAX_WAVES = 3;

/**
 * Of a manifest: noise whose cells are so many tile sides wide, and what noise of 1 adds to each material.
 * @typedef {{ wavelength: number, colours: number[][] }} Wave
 *
 * at: what is added to red, green and blue at a place; scales: cosine and sine of a wave's turn, in cells a unit;
 * under: as of heights.
 * @typedef {{ waves: Wave[], salt: number, scales: number[], under: import("./heights.js").Under,
 *   at: (x: number, y: number, material: number) => number[] }} Variation
 */

/**
 * The variation of a terrain, or null.
 *
 * @param {Pick<import("../data/manifest.js").Manifest, "variation" | "tile_side" | "salt" | "heights">} manifest
 * @returns {Variation | null}
 */
export function createVariation({ variation: waves, tile_side: side, salt, heights }) {
  if (!waves || heights?.kind === "sphere") return null;
  const noises = waves.map((_, k) => createNoise(VARIATION + k, salt));
  /** Place in each wave's cells. @param {number} x @param {number} y */
  const placesAt = (x, y) => waves.map(({ wavelength }, k) => {
    [x, y] = [TURN[0] * x - TURN[1] * y, TURN[1] * x + TURN[0] * y];
    return [x, y].map((v, axis) => v / (wavelength * side) + k * SHIFT[axis]);
  });
  const origin = placesAt(0, 0), east = placesAt(1, 0);
  return {
    waves, salt, scales: east.flatMap((place, k) => place.map((v, axis) => v - origin[k][axis])),
    at(x, y, material) {
      const change = [0, 0, 0];
      for (const [k, [u, v]] of placesAt(x, y).entries()) {
        const noise = noises[k](u, v);
        for (let c = 0; c < 3; c++) change[c] += noise * waves[k].colours[material][c];
      }
      return change;
    },
    under(x, y) {
      const places = placesAt(x, y).flat(), cells = places.map(Math.floor);
      return { cells: Int32Array.from(cells), places: Float32Array.from(places, (v, k) => v - cells[k]) };
    },
  };
}

export const MAX_OCTAVES = 8;
const JITTER = 80; // octave k uses JITTER + k for the first four materials, JITTER + MAX_OCTAVES + k for the others
const CONTRAST = 3; // the jitter is its noise times this, cut at -1 and 1
const MAX_TABLE = 64; // cells of the finest jitter along a tile's side whose gradients are kept for a cell

/**
 * The jitter of a rule: fine noise at places of a cell, counted from the cell's own corner.
 *
 * @param {import("./classes.js").ClassesEntry} entry @param {number} materials
 */
export function createJitter({ jitter: { cells: coarse, gains, amplitude }, salt }, materials) {
  const octaves = gains.length, total = gains.reduce((a, b) => a + b, 0);
  const sizes = gains.map((_, k) => coarse * 2 ** k), dense = sizes[octaves - 1] <= MAX_TABLE;
  const tables = sizes.map((cells) => new Float64Array(dense ? 2 * materials * (cells + 2) ** 2 : 0));
  const corners = new Float64Array(8 * materials);
  let east = NaN, north = NaN; // the cell of the tables

  /** Gradients at the integer points of a cell. @param {number} i @param {number} j */
  function fillTables(i, j) {
    for (let k = 0; k < octaves; k++) {
      const cells = sizes[k], table = tables[k];
      for (let row = 0, at = 0; row < cells + 2; row++) {
        for (let column = 0; column < cells + 2; column++, at += 2 * materials) {
          cornerGradients(i * cells + column, j * cells + row, k, table, at);
        }
      }
    }
    east = i;
    north = j;
  }

  /**
   * Gradients of all materials at an integer point: one hash serves four materials, a byte each.
   *
   * @param {number} x @param {number} y @param {number} octave @param {Float64Array} out
   * @param {number} at
   */
  function cornerGradients(x, y, octave, out, at) {
    for (let m = 0, bits = 0; m < materials; m++, bits >>>= 8) {
      if (m % 4 === 0) bits = hashCell(x, y, JITTER + 2 * m + octave, salt);
      out[at + 2 * m] = (bits & 15) / 7.5 - 1;
      out[at + 2 * m + 1] = ((bits >>> 4) & 15) / 7.5 - 1;
    }
  }

  /** @param {number} i @param {number} j @param {number} u @param {number} v @param {Float64Array} out */
  return (i, j, u, v, out) => {
    if (dense && (i !== east || j !== north)) fillTables(i, j);
    for (let octave = 0; octave < octaves; octave++) {
      const cells = sizes[octave], x = cells * u + octave * SHIFT[0], y = cells * v + octave * SHIFT[1];
      const column = Math.min(Math.max(Math.floor(x), 0), cells), row = Math.min(Math.max(Math.floor(y), 0), cells);
      const s = x - column, t = y - row, across = fade(s), along = fade(t), gain = gains[octave];
      const sw = (1 - across) * (1 - along), se = across * (1 - along), nw = (1 - across) * along, ne = across * along;
      const table = dense ? tables[octave] : corners, wide = dense ? cells + 2 : 2, item = 2 * materials;
      for (let k = 0; k < (dense ? 0 : 4); k++) {
        cornerGradients(i * cells + column + (k & 1), j * cells + row + (k >> 1), octave, corners, item * k);
      }
      for (let m = 0, a = dense ? (row * wide + column) * item : 0; m < materials; m++, a += 2) {
        const b = a + item, c = a + wide * item, d = c + item;
        const noise = sw * (table[a] * s + table[a + 1] * t) + se * (table[b] * (s - 1) + table[b + 1] * t)
          + nw * (table[c] * s + table[c + 1] * (t - 1)) + ne * (table[d] * (s - 1) + table[d + 1] * (t - 1));
        out[m] = (octave ? out[m] : 0) + gain * noise;
      }
    }
    for (let m = 0; m < materials; m++) {
      out[m] = amplitude * Math.min(Math.max(CONTRAST * (out[m] / total), -1), 1);
    }
    return out;
  };
}
