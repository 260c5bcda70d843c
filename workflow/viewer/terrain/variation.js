// Variation of the place: large-scale light and dark, as noise of the place that is added to colours.
// The same numbers as dav_gswt/terrain/variation.py; tests/golden/heights.json holds both to it.

import { createNoise, SHIFT } from "./heights.js";

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
