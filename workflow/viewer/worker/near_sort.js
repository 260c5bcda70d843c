// The 3 x 3 block of cells about the eye: all its Gaussians sorted by depth, as no single direction serves a whole tile
// there.

import { SLOT_SHIFT } from "../data/layout.js";
import { createDepthSorter } from "../terrain/depth_sort.js";
import { frustumPlanes, RIM } from "../terrain/frustum.js";

/**
 * @typedef {import("../terrain/frustum.js").Cell} Cell
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {Pick<import("./terrain_tables.js").TerrainTables, "side" | "near" | "deviations" | "heights">} Tables
 * @typedef {{ centres: Float32Array, sizes: Uint8Array, entries: Uint32Array, count: number }} NearChunk
 */

const CACHED = 64; // cells and levels whose surface heights are kept
const MARGIN = 0.65; // of the picture's side from its centre: where projections of farther splats are linearised

/**
 * A function that gives the entries of the close cells' Gaussians that have a weight and may reach into the picture,
 * back to front.
 *
 * @param {{ get: (tile: number, level: number) => NearChunk }} store
 * @param {Tables} terrain
 */
export function createNearSorter(store, terrain) {
  const sort = createDepthSorter(), lifts = createLiftCache(terrain);
  let depths = new Float32Array(0), candidates = new Uint32Array(0);

  /**
   * @param {Cell[]} cells
   * @param {Camera} camera
   * @param {{ switches: number[], bands: number[] }} distances
   */
  return function sortNear(cells, camera, { switches, bands }) {
    const { side, near, deviations } = terrain, { eye, ahead } = camera;
    const [a0, b0, c0, across, a1, b1, c1, , a2, b2, c2, along, a3, b3, c3] = sidePlanes(camera, terrain);
    const most = cells.reduce((sum, cell) => sum + cell.count, 0);
    if (depths.length < most) [depths, candidates] = [new Float32Array(2 * most), new Uint32Array(2 * most)];
    const i0 = Math.floor(eye[0] / side), j0 = Math.floor(eye[1] / side);
    let n = 0;
    for (const { di, dj, tile, lo, hi, whole } of cells) {
      const west = (i0 + di) * side - eye[0], south = (j0 + dj) * side - eye[1], slot = (dj + 1) * 3 + di + 1;
      for (let level = lo; level <= hi; level++) {
        const chunk = store.get(tile, level), { centres, sizes, entries, count } = chunk;
        const lift = lifts.get(i0 + di, j0 + dj, level, chunk);
        const begin = whole || !level ? 0 : Math.max(0, switches[level - 1] - bands[level - 1]);
        const end = whole ? Infinity : switches[level] + bands[level];
        for (let k = 0; k < count; k++) {
          const x = centres[3 * k] + west, y = centres[3 * k + 1] + south;
          const z = centres[3 * k + 2] - eye[2] + (lift ? lift[k] : 0);
          const depth = ahead[0] * x + ahead[1] * y + ahead[2] * z, square = x * x + y * y + z * z;
          if (depth <= 0.5 * near || square < begin * begin || square > end * end) continue;
          const size = deviations[sizes[k]], wide = -across * size, tall = -along * size;
          if (a0 * x + b0 * y + c0 * z < wide || a1 * x + b1 * y + c1 * z < wide) continue;
          if (a2 * x + b2 * y + c2 * z < tall || a3 * x + b3 * y + c3 * z < tall) continue;
          depths[n] = depth;
          candidates[n++] = ((entries[k] & 0x0fffffff) | (slot << SLOT_SHIFT)) >>> 0;
        }
      }
    }
    const sequence = sort(depths, n), out = new Uint32Array(n);
    for (let k = 0; k < n; k++) out[k] = candidates[sequence[k]];
    return out;
  };
}

/**
 * Heights of the surface under the Gaussians of cells, of the most recent ones kept.
 *
 * @param {Tables} terrain
 */
function createLiftCache(terrain) {
  /** @type {Map<string, Float32Array>} */
  const lifts = new Map();
  return {
    /**
     * Heights under a chunk in a cell; null: level ground.
     *
     * @param {number} i
     * @param {number} j
     * @param {number} level
     * @param {NearChunk} chunk
     */
    get(i, j, level, { centres, count }) {
      if (terrain.heights.kind === "flat") return null;
      const key = `${i},${j},${level},${count}`;
      let lift = lifts.get(key);
      if (!lift) {
        lift = new Float32Array(count);
        for (let k = 0; k < count; k++) {
          lift[k] = terrain.heights.at(i * terrain.side + centres[3 * k], j * terrain.side + centres[3 * k + 1])[0];
        }
      } else lifts.delete(key);
      lifts.set(key, lift); // the latest last
      if (lifts.size > CACHED) lifts.delete(lifts.keys().next().value ?? "");
      return lift;
    },
  };
}

/**
 * Left, right, bottom and top plane of the frustum: inward normal, and the distance outside, for a deviation of 1, of the
 * centre of a Gaussian that just reaches the plane. A splat's extent in the picture is that of x - s z, with a slope s
 * of at most MARGIN of the picture's side over the focal length (draw/shaders.js): sqrt(1 + s^2) times a deviation,
 * which the surface's slope shears by less than 1 + slope.
 *
 * @param {Camera} camera
 * @param {Tables} terrain
 */
function sidePlanes(camera, { heights: { steepest } }) {
  const { focal, width, height } = camera, sizes = [width, width, height, height];
  return frustumPlanes(camera, 0).slice(1).flatMap(([a, b, c], k) => {
    return [a, b, c, focal * RIM * (1 + steepest) * Math.hypot(1, (MARGIN * sizes[k]) / focal)];
  });
}
