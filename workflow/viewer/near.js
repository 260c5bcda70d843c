// The 3 x 3 cells about the eye: all their Gaussians, sorted exactly by depth, as no one direction is the viewing
// direction of a whole tile there.

import { createSorter } from "./order.js";
import { SLOT_SHIFT } from "./runs.js";
import { planesOf, RIM } from "./sight.js";

const KEPT = 64; // surfaces of cells and levels that are remembered
const BOUND = 0.65; // of the picture's side from its middle: where the camera is linearised for what is further out

export function createNear(store, terrain) {
  const sorted = createSorter(), lifts = new Map();
  let depths = new Float32Array(0), found = new Uint32Array(0);

  /** Heights of the surface under a chunk's Gaussians in a cell; null: level ground. */
  function liftOf(i, j, level, { centres, count }) {
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
    if (lifts.size > KEPT) lifts.delete(lifts.keys().next().value);
    return lift;
  }

  /**
   * Entries of the close cells' Gaussians that have a weight and may reach into the picture, back to front along
   * `ahead`; level distances of budget.js.
   */
  return function nearOrder(cells, camera, { switches, bands }) {
    const { side, near, deviations } = terrain, { eye, ahead } = camera;
    const [a0, b0, c0, across, a1, b1, c1, , a2, b2, c2, along, a3, b3, c3] = wallsOf(camera, terrain);
    const most = cells.reduce((sum, cell) => sum + cell.count, 0);
    if (depths.length < most) [depths, found] = [new Float32Array(2 * most), new Uint32Array(2 * most)];
    const i0 = Math.floor(eye[0] / side), j0 = Math.floor(eye[1] / side);
    let n = 0;
    for (const { di, dj, tile, lo, hi, whole } of cells) {
      const west = (i0 + di) * side - eye[0], south = (j0 + dj) * side - eye[1], slot = (dj + 1) * 3 + di + 1;
      for (let level = lo; level <= hi; level++) {
        const chunk = store.get(tile, level), { centres, sizes, entries, count } = chunk;
        const lift = liftOf(i0 + di, j0 + dj, level, chunk);
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
          found[n++] = ((entries[k] & 0x0fffffff) | (slot << SLOT_SHIFT)) >>> 0;
        }
      }
    }
    const sequence = sorted(depths, n), out = new Uint32Array(n);
    for (let k = 0; k < n; k++) out[k] = found[sequence[k]];
    return out;
  };
}

/**
 * The frustum's four sides, left, right, bottom and top: inward normals, and how far outside, for a deviation of 1, the
 * centre of a Gaussian lies that just reaches them. A splat's extent in the picture is that of x - s z, with a slope s
 * of at most BOUND of the picture's side over its focal length (shader.js): sqrt(1 + s^2) times a deviation, which the
 * surface's slope shears by less than 1 + slope.
 */
function wallsOf(camera, { heights: { steepest } }) {
  const { focal, width, height } = camera, sizes = [width, width, height, height];
  return planesOf(camera, 0).slice(1).flatMap(([a, b, c], k) => {
    return [a, b, c, focal * RIM * (1 + steepest) * Math.hypot(1, (BOUND * sizes[k]) / focal)];
  });
}
