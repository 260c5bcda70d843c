// The 3 x 3 block of cells about the eye: all its Gaussians sorted by depth, as no single direction serves a whole tile
// there, with those of the objects that are drawn with its cells.

import { CODE_SHIFT, MAX_LEVELS, SLOTS } from "../data/layout.js";
import { createRecentCache } from "../terrain/caches.js";
import { createDepthSorter } from "../terrain/draw_order.js";
import { frustumPlanes, RIM } from "../terrain/frustum.js";
import { bend, FACES, rateOf } from "../terrain/sphere.js";
import { STRETCH } from "../terrain/sphere_cells.js";

/**
 * @typedef {import("../terrain/frustum.js").Cell} Cell
 * @typedef {import("../terrain/scatter.js").Thing} Thing
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {Pick<import("./terrain_tables.js").TerrainTables, "side" | "near" | "deviations" | "heights" | "sphere">} Tables
 * @typedef {{ centres: Float32Array, sizes: Uint8Array, entries: Uint32Array, count: number }} NearChunk
 *
 * An object in the block, and the codes of its levels from lo on.
 * @typedef {{ thing: Thing, codes: number[] }} NearThing
 *
 * Gaussians of one chunk in a cell: all of it, or those that stay. lift: of the surface under each, if it is not level;
 * x, y, z: of the chunk's origin, from the eye; size: factor on deviations.
 * @typedef {{ chunk: NearChunk, lift: Float32Array | null }} Placed
 * @typedef {Placed & { x: number, y: number, z: number, size: number, code: number, begin: number, end: number }} Part
 * @typedef {{ switches: number[], bands: number[] }} Distances
 */

const CELLS = 256, THINGS = 512; // chunks in cells, and of objects, whose heights or places are kept
const MARGIN = 0.65; // of the picture's side from its centre: where projections of farther splats are linearised
const INDEX = (1 << CODE_SHIFT) - 1; // bits of an entry

/**
 * A function that gives the entries of the close cells' Gaussians that have a weight and may reach into the picture,
 * back to front.
 *
 * @param {{ get: (tile: number, level: number) => NearChunk }} store @param {Tables} terrain
 * @param {Pick<import("./sorted_batches.js").Borders, "keep">} borders
 */
export function createNearSorter(store, terrain, borders) {
  const sort = createDepthSorter(), recallCell = createRecall(CELLS), recallThing = createRecall(THINGS);
  let depths = new Float32Array(0), candidates = new Uint32Array(0);

  /**
   * The parts of a cell: its levels and materials. place: of a cell on a sphere.
   *
   * @param {Cell} cell @param {number} place @param {number[]} eye @param {Distances} distances
   */
  function partsOfCell({ di, dj, tiles, border, lo, hi, whole, spot }, place, eye, distances) {
    const { side } = terrain, slot = spot ? place : (dj + 1) * 3 + di + 1;
    const i = spot ? di : Math.floor(eye[0] / side) + di, j = spot ? dj : Math.floor(eye[1] / side) + dj;
    const [x, y, z] = spot ? spot.centre : [i * side - eye[0], j * side - eye[1], -eye[2]];
    /** @type {Part[]} */
    const parts = [];
    for (let level = lo; level <= hi; level++) {
      for (const tile of tiles) {
        const all = store.get(tile, level), code = SLOTS + MAX_LEVELS * slot + level;
        const placed = recallCell(`${i},${j},${level},${tile},${border?.serial ?? 0}`, all, () => {
          const kept = border ? gather(all, borders.keep(border, tile, level)) : all;
          return spot ? bendChunk(kept, spot, terrain) : { chunk: kept, lift: liftsUnder(kept, i, j, terrain) };
        });
        if (placed.chunk.count) parts.push({ ...placed, x, y, z, size: 1, code, ...rangeOf(level, whole, distances) });
      }
    }
    return parts;
  }

  /** The parts of an object: its levels. @param {NearThing} near @param {Distances} distances @returns {Part[]} */
  function partsOfThing({ thing, codes }, distances) {
    const { lo, whole, tile, i, j, u, v, to: [x, y, z], size } = thing;
    return codes.map((code, k) => {
      const level = lo + k, all = store.get(tile, level);
      const placed = recallThing(`${i},${j},${u},${v},${level},${tile}`, all, () => turnChunk(all, thing, terrain));
      return { ...placed, x, y, z, size, code, ...rangeOf(level, whole, distances) };
    });
  }

  /**
   * @param {Cell[]} cells @param {Camera} camera
   * @param {Distances} distances @param {NearThing[]} [things]
   */
  return function sortNear(cells, camera, distances, things = []) {
    const { near, deviations } = terrain, { eye, ahead } = camera;
    const [a0, b0, c0, across, a1, b1, c1, , a2, b2, c2, along, a3, b3, c3] = sidePlanes(camera, terrain);
    const parts = cells.flatMap((cell, k) => partsOfCell(cell, k, eye, distances));
    parts.push(...things.flatMap((one) => partsOfThing(one, distances)));
    const most = parts.reduce((sum, { chunk }) => sum + chunk.count, 0);
    if (depths.length < most) [depths, candidates] = [new Float32Array(2 * most), new Uint32Array(2 * most)];
    let n = 0;
    for (const part of parts) {
      const { chunk: { centres, sizes, entries, count }, lift, begin, end, size: factor } = part;
      const { x: west, y: south, z: up } = part, mark = part.code << CODE_SHIFT;
      for (let k = 0; k < count; k++) {
        const x = centres[3 * k] + west, y = centres[3 * k + 1] + south;
        const z = centres[3 * k + 2] + up + (lift ? lift[k] : 0);
        const depth = ahead[0] * x + ahead[1] * y + ahead[2] * z, square = x * x + y * y + z * z;
        if (depth <= 0.5 * near || square < begin * begin || square > end * end) continue;
        const size = factor * deviations[sizes[k]], wide = -across * size, tall = -along * size;
        if (a0 * x + b0 * y + c0 * z < wide || a1 * x + b1 * y + c1 * z < wide) continue;
        if (a2 * x + b2 * y + c2 * z < tall || a3 * x + b3 * y + c3 * z < tall) continue;
        depths[n] = depth;
        candidates[n++] = ((entries[k] & INDEX) | mark) >>> 0;
      }
    }
    const sequence = sort(depths, n), out = new Uint32Array(n);
    for (let k = 0; k < n; k++) out[k] = candidates[sequence[k]];
    return out;
  };
}

/**
 * The distances between which a level has a weight.
 *
 * @param {number} level @param {boolean} whole
 * @param {Distances} distances
 */
const rangeOf = (level, whole, { switches, bands }) => ({
  begin: whole || !level ? 0 : Math.max(0, switches[level - 1] - bands[level - 1]),
  end: whole ? Infinity : switches[level] + bands[level],
});

/**
 * A function that recalls the most recent values by key, or makes one anew where it was made from another chunk.
 *
 * @param {number} most
 */
function createRecall(most) {
  /** @type {ReturnType<typeof createRecentCache<string, Placed & { from: NearChunk }>>} */
  const known = createRecentCache(most, () => 1);
  /** @param {string} key @param {NearChunk} from @param {() => Placed} make */
  return (key, from, make) => {
    const old = known.get(key);
    return known.keep(key, old && old.from === from ? old : { ...make(), from });
  };
}

/** A chunk's Gaussians that stay in a cell; null: all. @param {NearChunk} chunk @param {Uint32Array | null} kept */
function gather(chunk, kept) {
  if (!kept) return chunk;
  const count = kept.length, centres = new Float32Array(3 * count);
  for (let m = 0, at = 0; m < count; m++) {
    const from = 3 * kept[m];
    for (let n = 0; n < 3; n++) centres[at++] = chunk.centres[from + n];
  }
  return {
    centres, sizes: Uint8Array.from(kept, (k) => chunk.sizes[k]),
    entries: Uint32Array.from(kept, (k) => chunk.entries[k]), count,
  };
}

/**
 * Heights of the surface under a chunk in a cell; null: level ground.
 *
 * @param {NearChunk} chunk @param {number} i @param {number} j @param {Tables} terrain
 */
function liftsUnder({ centres, count }, i, j, { heights, side }) {
  if (heights.kind === "flat") return null;
  const lift = new Float32Array(count);
  for (let k = 0; k < count; k++) lift[k] = heights.at(i * side + centres[3 * k], j * side + centres[3 * k + 1])[0];
  return lift;
}

/**
 * The chunk of a cell on a sphere, from the place of the cell's middle on the ground.
 *
 * @param {NearChunk} chunk @param {import("../terrain/sphere_cells.js").Spot} spot @param {Tables} terrain
 * @returns {Placed}
 */
function bendChunk(chunk, { face, s, t }, { sphere, side }) {
  const { centres, count } = chunk, out = new Float32Array(3 * count), made = [0, 0, 0], axes = FACES[face];
  const rate = sphere ? rateOf(sphere, side) : 0, half = 0.5 * side;
  for (let k = 0; k < 3 * count; k += 3) {
    bend(centres[k] - half, centres[k + 1] - half, centres[k + 2], s, t, sphere?.radius ?? 0, rate, made);
    for (let c = 0; c < 3; c++) out[k + c] = made[0] * axes[0][c] + made[1] * axes[1][c] + made[2] * axes[2][c];
  }
  return { chunk: { ...chunk, centres: out }, lift: null };
}

/**
 * The chunk of an object with its Gaussians on the surface, from the foot.
 *
 * @param {NearChunk} chunk @param {Thing} thing @param {Tables} terrain
 * @returns {Placed}
 */
function turnChunk(chunk, { i, j, u, v, cos, sin, size, h }, { heights, side }) {
  const { centres, count } = chunk, out = new Float32Array(3 * count);
  for (let k = 0; k < 3 * count; k += 3) {
    const x = size * (cos * centres[k] - sin * centres[k + 1]), y = size * (sin * centres[k] + cos * centres[k + 1]);
    out[k] = x;
    out[k + 1] = y;
    out[k + 2] = size * centres[k + 2] + heights.at((i + u) * side + x, (j + v) * side + y)[0] - h;
  }
  return { chunk: { ...chunk, centres: out }, lift: null };
}

/**
 * Left, right, bottom and top plane of the frustum: inward normal, and the distance outside, for a deviation of 1, of the
 * centre of a Gaussian that just reaches the plane. A splat's extent in the picture is that of x - s z, with a slope s
 * of at most MARGIN of the picture's side over the focal length (draw/shaders.js): sqrt(1 + s^2) times a deviation,
 * which the surface's slope shears by less than 1 + slope.
 *
 * @param {Camera} camera @param {Tables} terrain
 */
function sidePlanes(camera, { heights: { steepest }, sphere }) {
  const stretch = sphere ? STRETCH : 1 + steepest;
  const { focal, width, height } = camera, sizes = [width, width, height, height];
  return frustumPlanes(camera, 0).slice(1).flatMap(([a, b, c], k) => {
    return [a, b, c, focal * RIM * stretch * Math.hypot(1, (MARGIN * sizes[k]) / focal)];
  });
}
