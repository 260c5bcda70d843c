// Tiles on the faces of a sphere, and the frayed edges where two faces meet turned.
// The same as dav_gswt/terrain/planet.py, which explains it; tests/golden/sphere.json holds both to it.

import { tileAt } from "./choice.js";
import { createNoise, SHIFT } from "./heights.js";
import { QUARTER } from "./sphere.js";

const FRAY = 120; // axis of the hash of edge 0; edge k uses FRAY + 2 k and the next
const FINE = [3, 9]; // cells of the two octaves of the noise, on a tile's side
const WIDTH = 0.3, CONTRAST = 2.5; // tile sides: most that an edge is moved; factor on the noise, which is cut then
const TAPER = 0.5; // of the distance from a corner, in tile sides
const LEVEL = 0.03, LIFT = 2, HIGHEST = 0.2; // what is higher reaches over the edge

/**
 * The tile in a cell of a face, or of its tiling beyond its edges.
 *
 * @param {{ cells: number }} sphere @param {number} face @param {number} i @param {number} j
 * @param {number} salt @param {number} variants
 */
export function tileOn({ cells: n }, face, i, j, salt, variants) {
  return tileAt(((face + 1) >> 1) * n + i, (face >> 1) * n + j, salt, variants, 3 * n);
}

/**
 * Is a cell of a face, or beyond one of its turned edges by one and not at a corner?
 *
 * @param {{ cells: number }} sphere @param {number} face @param {number} i @param {number} j
 */
export function isCovered({ cells: n }, face, i, j) {
  const odd = face & 1, insideI = i >= 0 && i < n, insideJ = j >= 0 && j < n;
  return (insideI && (insideJ || j === (odd ? -1 : n))) || (insideJ && i === (odd ? n : -1));
}

/**
 * Does a cell lie at a turned edge of its face, or beyond it?
 *
 * @param {{ cells: number }} sphere @param {number} face @param {number} i @param {number} j
 */
export const isFrayed = ({ cells: n }, face, i, j) => (face & 1 ? i >= n - 1 || j <= 0 : i <= 0 || j >= n - 1);

/**
 * Which Gaussians of tiles at turned edges stay.
 *
 * @param {{ cells: number }} sphere @param {number} side @param {number} salt
 */
export function createFraying({ cells }, side, salt) {
  const perCell = QUARTER / cells, half = 0.5 * cells;
  const noises = Array.from({ length: 12 }, (_, k) => createNoise(FRAY + k, salt));

  /** @param {number} edge @param {number} along @param {number} across @param {number} sign */
  function moveEdge(edge, along, across, sign) {
    const tangent = Math.tan(across * perCell), beyond = sign * (across - half);
    const middle = Math.atan(Math.tan(along * perCell) * Math.sqrt(2 / (1 + tangent * tangent))) / perCell;
    const most = Math.min(Math.max(TAPER * (half - Math.abs(middle)), 0), WIDTH);
    const first = noises[2 * edge](middle * FINE[0], beyond * FINE[0]);
    const second = noises[2 * edge + 1](middle * FINE[1] + SHIFT[0], beyond * FINE[1] + SHIFT[1]);
    return most * Math.min(Math.max(CONTRAST * (first + 0.5 * second), -1), 1);
  }

  /**
   * Does a Gaussian stay? a, b: in cells from the face's south-western corner; z: tile sides.
   *
   * @param {number} face @param {number} a @param {number} b @param {number} z
   */
  function stays(face, a, b, z) {
    const odd = face & 1, u = a - half, v = b - half;
    const over = Math.min(LIFT * Math.max(Math.abs(z) - LEVEL, 0), HIGHEST);
    const out = odd ? u : v, into = odd ? -v : -u;
    return out - half <= moveEdge(face, odd ? v : u, out, 1) + over
      && into - half < over - moveEdge((face + 4) % 6, odd ? -u : -v, into, -1);
  }

  return {
    stays,
    /**
     * Indices of a tile's Gaussians that stay in a cell.
     *
     * @param {number} column of all faces, see `columnOf`
     * @param {number} j @param {{ centres: Float32Array, count: number }} chunk
     */
    keep(column, j, { centres, count }) {
      const face = Math.floor(column / (cells + 2)), i = column - face * (cells + 2) - 1, found = new Uint32Array(count);
      let n = 0;
      for (let k = 0; k < count; k++) {
        const [x, y, z] = [centres[3 * k] / side, centres[3 * k + 1] / side, centres[3 * k + 2] / side];
        if (stays(face, i + x, j + y, z)) found[n++] = k;
      }
      return found.slice(0, n);
    },
  };
}

/** The columns of all faces beside each other, as dav_gswt/terrain/planet.py. @param {{ cells: number }} sphere @param {number} face @param {number} i */
export const columnOf = ({ cells }, face, i) => face * (cells + 2) + i + 1;
