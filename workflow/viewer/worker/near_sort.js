// The 3 x 3 block of cells about the eye: all its Gaussians sorted by depth, as no single direction serves a whole tile
// there, with those of the objects that are drawn with its cells.

import { CODE_SHIFT, MAX_LEVELS, SLOTS } from "../data/layout.js";
import { createDepthSorter } from "../terrain/draw_order.js";
import { frustumPlanes, RIM } from "../terrain/frustum.js";
import { bend, FACES, rateOf } from "../terrain/sphere.js";
import { STRETCH } from "../terrain/sphere_cells.js";

/**
 * @typedef {import("../terrain/frustum.js").Cell} Cell
 * @typedef {import("../terrain/scatter.js").Thing} Thing
 * @typedef {import("../terrain/cells.js").Border} Border
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {Pick<import("./terrain_tables.js").TerrainTables, "side" | "near" | "deviations" | "heights" | "sphere">} Tables
 * @typedef {{ centres: Float32Array, sizes: Uint8Array, entries: Uint32Array, count: number }} NearChunk
 *
 * An object in the block, and the codes of its levels from lo on.
 * @typedef {{ thing: Thing, codes: number[] }} NearThing
 *
 * Gaussians of one chunk in a cell: all of it, or those that stay. x, y, z: of the chunk's origin, from the eye; lift:
 * of the surface under each, if it is not level; size: factor on deviations.
 * @typedef {{ chunk: NearChunk, lift: Float32Array | null, x: number, y: number, z: number, size: number, code: number,
 *   begin: number, end: number }} Part
 */

const CACHED = 256; // chunks in cells, and objects, whose heights or places are kept
const MARGIN = 0.65; // of the picture's side from its centre: where projections of farther splats are linearised
const INDEX = (1 << CODE_SHIFT) - 1; // bits of an entry

/**
 * A function that gives the entries of the close cells' Gaussians that have a weight and may reach into the picture,
 * back to front.
 *
 * @param {{ get: (tile: number, level: number) => NearChunk }} store
 * @param {Tables} terrain
 * @param {Pick<import("./borders.js").Borders, "keep">} borders
 */
export function createNearSorter(store, terrain, borders) {
  const sort = createDepthSorter(), findLift = createLiftCache(terrain), findTurned = createTurnCache(terrain);
  const findKept = createKeptCache(borders), findBent = createBendCache(terrain);
  let depths = new Float32Array(0), candidates = new Uint32Array(0);

  /**
   * The parts of a cell: its levels and materials.
   *
   * @param {Cell} cell
   * @param {number[]} eye
   * @param {{ switches: number[], bands: number[] }} distances
   * @returns {Part[]}
   */
  function partsOfCell({ di, dj, tiles, border, lo, hi, whole: single }, eye, distances) {
    const { side } = terrain, i = Math.floor(eye[0] / side) + di, j = Math.floor(eye[1] / side) + dj, parts = [];
    const place = { x: i * side - eye[0], y: j * side - eye[1], z: -eye[2], size: 1 }, slot = (dj + 1) * 3 + di + 1;
    for (let level = lo; level <= hi; level++) {
      const range = rangeOf(level, single, distances);
      for (const tile of tiles) {
        const whole = store.get(tile, level), key = `${i},${j},${level},${tile},${border?.serial ?? 0}`;
        const chunk = border ? findKept(key, border, tile, level, whole) : whole;
        const lift = findLift(key, i, j, chunk), code = SLOTS + MAX_LEVELS * slot + level;
        if (chunk.count) parts.push({ chunk, lift, ...place, code, begin: range.begin, end: range.end });
      }
    }
    return parts;
  }

  /**
   * The parts of a cell of a sphere.
   *
   * @param {Cell} cell
   * @param {import("../terrain/sphere_cells.js").Spot} spot
   * @param {number} place
   * @param {{ switches: number[], bands: number[] }} distances
   * @returns {Part[]}
   */
  function partsOnSphere({ di, dj, tile, border, lo, hi, whole }, spot, place, distances) {
    const [x, y, z] = spot.centre, parts = [];
    for (let level = lo; level <= hi; level++) {
      const all = store.get(tile, level), key = `${di},${dj},${level},${tile},${border?.serial ?? 0}`;
      const chunk = findBent(key, spot, border ? findKept(key, border, tile, level, all) : all);
      const code = SLOTS + MAX_LEVELS * place + level;
      if (chunk.count) parts.push({ chunk, lift: null, x, y, z, size: 1, code, ...rangeOf(level, whole, distances) });
    }
    return parts;
  }

  /**
   * The parts of an object: its levels.
   *
   * @param {NearThing} near
   * @param {{ switches: number[], bands: number[] }} distances
   * @returns {Part[]}
   */
  function partsOfThing({ thing, codes }, distances) {
    const { lo, whole, tile, to: [x, y, z], size } = thing;
    return codes.map((code, k) => {
      const chunk = findTurned(thing, lo + k, store.get(tile, lo + k));
      const { begin, end } = rangeOf(lo + k, whole, distances);
      return { chunk, lift: null, x, y, z, size, code, begin, end };
    });
  }

  /**
   * @param {Cell[]} cells
   * @param {Camera} camera
   * @param {{ switches: number[], bands: number[] }} distances
   * @param {NearThing[]} [things]
   */
  return function sortNear(cells, camera, distances, things = []) {
    const { near, deviations } = terrain, { eye, ahead } = camera;
    const [a0, b0, c0, across, a1, b1, c1, , a2, b2, c2, along, a3, b3, c3] = sidePlanes(camera, terrain);
    const parts = cells.flatMap((cell, k) => (
      cell.spot ? partsOnSphere(cell, cell.spot, k, distances) : partsOfCell(cell, eye, distances)));
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
 * @param {number} level
 * @param {boolean} whole
 * @param {{ switches: number[], bands: number[] }} distances
 */
const rangeOf = (level, whole, { switches, bands }) => ({
  begin: whole || !level ? 0 : Math.max(0, switches[level - 1] - bands[level - 1]),
  end: whole ? Infinity : switches[level] + bands[level],
});

/**
 * Values by a key, with what they were made from; the most recent ones are kept.
 *
 * @template K, T
 */
function createRecentCache() {
  /** @type {Map<K, { from: unknown, value: T }>} */
  const known = new Map();
  /** @param {K} key @param {unknown} from @param {() => T} make */
  return (key, from, make) => {
    const old = known.get(key), entry = old && old.from === from ? old : { from, value: make() };
    known.delete(key);
    known.set(key, entry); // the latest last
    for (const oldest of known.keys()) {
      if (known.size <= CACHED) break;
      known.delete(oldest);
    }
    return entry.value;
  };
}

/**
 * A function that gives the Gaussians of a chunk that stay in a cell.
 *
 * @param {Pick<import("./borders.js").Borders, "keep">} borders
 */
function createKeptCache(borders) {
  const recall = /** @type {ReturnType<typeof createRecentCache<string, NearChunk>>} */ (createRecentCache());
  /** @param {string} key @param {Border} border @param {number} tile @param {number} level @param {NearChunk} chunk */
  return (key, border, tile, level, chunk) => recall(key, chunk, () => {
    const kept = borders.keep(border, tile, level), count = kept ? kept.length : chunk.count;
    if (!kept) return chunk;
    const centres = new Float32Array(3 * count), sizes = new Uint8Array(count), entries = new Uint32Array(count);
    for (let m = 0; m < count; m++) {
      const k = kept[m];
      for (let axis = 0; axis < 3; axis++) centres[3 * m + axis] = chunk.centres[3 * k + axis];
      sizes[m] = chunk.sizes[k];
      entries[m] = chunk.entries[k];
    }
    return { centres, sizes, entries, count };
  });
}

/**
 * A function that gives the heights of the surface under a chunk in a cell; null: level ground.
 *
 * @param {Tables} terrain
 */
function createLiftCache({ heights, side }) {
  const recall = /** @type {ReturnType<typeof createRecentCache<string, Float32Array>>} */ (createRecentCache());
  /** @param {string} key @param {number} i @param {number} j @param {NearChunk} chunk */
  return (key, i, j, chunk) => (heights.kind === "flat" ? null : recall(key, chunk, () => {
    const { centres, count } = chunk, lift = new Float32Array(count);
    for (let k = 0; k < count; k++) lift[k] = heights.at(i * side + centres[3 * k], j * side + centres[3 * k + 1])[0];
    return lift;
  }));
}

/**
 * A function that gives the chunk of a cell on a sphere, from the place of the cell's middle on the ground.
 *
 * @param {Tables} terrain
 */
function createBendCache({ sphere, side }) {
  const recall = /** @type {ReturnType<typeof createRecentCache<string, NearChunk>>} */ (createRecentCache());
  const rate = sphere ? rateOf(sphere, side) : 0, half = 0.5 * side;
  /** @param {string} key @param {import("../terrain/sphere_cells.js").Spot} spot @param {NearChunk} chunk */
  return (key, { face, s, t }, chunk) => recall(key, chunk, () => {
    const { centres, count } = chunk, out = new Float32Array(3 * count), made = [0, 0, 0], axes = FACES[face];
    for (let k = 0; k < 3 * count; k += 3) {
      bend(centres[k] - half, centres[k + 1] - half, centres[k + 2], s, t, sphere?.radius ?? 0, rate, made);
      for (let c = 0; c < 3; c++) out[k + c] = made[0] * axes[0][c] + made[1] * axes[1][c] + made[2] * axes[2][c];
    }
    return { ...chunk, centres: out };
  });
}

/**
 * A function that gives the chunk of an object with its Gaussians on the surface, from the foot.
 *
 * @param {Tables} terrain
 */
function createTurnCache({ heights, side }) {
  /** @typedef {{ from: NearChunk, value: NearChunk }[]} Levels */
  const recall = /** @type {ReturnType<typeof createRecentCache<Thing, Levels>>} */ (createRecentCache());

  /** @param {Thing} thing @param {NearChunk} chunk @returns {NearChunk} */
  function turn({ i, j, u, v, cos, sin, size, h }, { centres, sizes, entries, count }) {
    const out = new Float32Array(3 * count);
    for (let k = 0; k < 3 * count; k += 3) {
      const x = size * (cos * centres[k] - sin * centres[k + 1]);
      const y = size * (sin * centres[k] + cos * centres[k + 1]);
      out[k] = x;
      out[k + 1] = y;
      out[k + 2] = size * centres[k + 2] + heights.at((i + u) * side + x, (j + v) * side + y)[0] - h;
    }
    return { centres: out, sizes, entries, count };
  }

  /** @param {Thing} thing @param {number} level @param {NearChunk} chunk */
  return (thing, level, chunk) => {
    const levels = recall(thing, null, () => []);
    if (levels[level]?.from !== chunk) levels[level] = { from: chunk, value: turn(thing, chunk) };
    return levels[level].value;
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
function sidePlanes(camera, { heights: { steepest }, sphere }) {
  const stretch = sphere ? STRETCH : 1 + steepest;
  const { focal, width, height } = camera, sizes = [width, width, height, height];
  return frustumPlanes(camera, 0).slice(1).flatMap(([a, b, c], k) => {
    return [a, b, c, focal * RIM * stretch * Math.hypot(1, (MARGIN * sizes[k]) / focal)];
  });
}
