// Scatter: where objects stand on the terrain, as a pure function of the cell.
// The same numbers as dav_gswt/terrain/scatter.py, where the idea is; tests/golden/scatter.json holds both to it.

import { createCellRing } from "./caches.js";
import { hashCell } from "./choice.js";

/**
 * The manifest's `scatter`, and what the scatter needs of its objects.
 * @typedef {{ cells: number, turn: number, size: number, salt: number }} ScatterEntry
 * @typedef {{ radius: number, material: number, probability: number }} ScatterObject
 *
 * An object on the terrain. i, j: cell of the foot; u, v: place of the foot in it, in tile sides; number: which object;
 * turn: in degrees, counter-clockwise; size: factor; radius: of the footprint, in tile sides.
 * @typedef {{ i: number, j: number, u: number, v: number, number: number, turn: number, size: number,
 *   radius: number }} Instance
 *
 * An object in a cell, and what the last view made of it. tile, tiles: its number after all tiles; border: none; cos,
 * sin: of its turn; h, east, north: surface under its foot; x, y: of the foot, in cells from the eye's; to: from the
 * eye to the foot; nearest, farthest: bounds of the distances of its Gaussians; lo to hi, whole, missing: as of a cell;
 * order: position among the orders that it keeps, and direction: which that is.
 * @typedef {Instance & { tile: number, tiles: number[], border: null, cos: number, sin: number,
 *   h: number, east: number, north: number, x: number, y: number, to: number[], distance: number, nearest: number,
 *   farthest: number, lo: number, hi: number, whole: boolean, missing: number, order: number,
 *   direction: number }} Thing
 *
 * An instance that may stand, its square (a, b) of the grid and its place x, y there, and the hash that decides.
 * @typedef {{ instance: Instance, reach: number, a: number, b: number, x: number, y: number,
 *   priority: number }} Candidate
 * @typedef {ReturnType<typeof createScatter>} Scatter
 */

const PLACE = 96, WHICH = 97, PRIORITY = 98, FORM = 99; // axes of the hash
const RIM = [[1, 0], [-1, 0], [0, 1], [0, -1]]; // where a footprint is tested against its material
export const MAX_RADIUS = 1; // of a footprint, in tile sides: at most 4 cells around a cell matter to it

/**
 * The scatter of a terrain.
 *
 * @param {ScatterEntry} entry @param {ScatterObject[]} objects
 * @param {number} side of a tile
 * @param {import("./classes.js").Classes | null} classes null: one material
 */
export function createScatter({ cells: n, turn, size, salt }, objects, side, classes) {
  const square = side / n, widest = 2 * Math.max(...objects.map(({ radius }) => radius)) * (1 + size);
  const ring = Math.ceil(Math.ceil((widest * n) / side) / n), materials = classes ? classes.materials : 1;
  /** @type {number[][]} */
  let thresholds = [];
  let most = 0;
  const rim = Math.ceil(widest / 2 / side); // cells around a cell whose classes decide about its candidates
  const candidates = createCellRing((i, j) => {
    const found = [];
    for (let row = 0; row < n; row++) {
      for (let column = 0; column < n; column++) {
        const candidate = findCandidate(i, j, i * n + column, j * n + row);
        if (candidate) found.push(candidate);
      }
    }
    return found;
  });
  const standing = createCellRing((i, j) => candidates.get(i, j).filter(stands).map(({ instance }) => instance));

  /**
   * The candidate of square (a, b) in cell (i, j), if it is an object whose footprint lies inside its material.
   *
   * @param {number} i @param {number} j @param {number} a @param {number} b
   * @returns {Candidate | null}
   */
  function findCandidate(i, j, a, b) {
    const chance = hashCell(a, b, WHICH, salt) / 4294967296;
    if (!(chance < most)) return null;
    const place = hashCell(a, b, PLACE, salt), form = hashCell(a, b, FORM, salt);
    const x = ((place & 0xffff) + 0.5) / 65536, y = ((place >>> 16) + 0.5) / 65536;
    const u = (a - i * n + x) / n, v = (b - j * n + y) / n, material = classes ? materialAt(classes, i, j, u, v) : 0;
    const number = thresholds[material].findIndex((bound) => chance < bound);
    if (number < 0) return null;
    const scale = 1 + size * ((form & 0xffff) / 32767.5 - 1), { radius } = objects[number];
    const instance = {
      i, j, u, v, number, turn: turn * ((form >>> 16) / 32767.5 - 1), size: scale, radius: (radius * scale) / side,
    };
    if (classes && !liesInside(classes, instance, material)) return null;
    return { instance, reach: radius * scale, a, b, x, y, priority: hashCell(a, b, PRIORITY, salt) };
  }

  /** Has no candidate of a higher priority a footprint that overlaps it? @param {Candidate} one */
  function stands(one) {
    const { i, j } = one.instance;
    for (let north = -ring; north <= ring; north++) {
      for (let east = -ring; east <= ring; east++) {
        for (const other of candidates.get(i + east, j + north)) {
          if (leads(other, one) && overlaps(other, one)) return false;
        }
      }
    }
    return true;
  }

  /** @param {Candidate} p @param {Candidate} q */
  function overlaps(p, q) {
    const dx = (p.a - q.a + (p.x - q.x)) * square, dy = (p.b - q.b + (p.y - q.y)) * square, reach = p.reach + q.reach;
    return dx * dx + dy * dy < reach * reach;
  }

  function clear() {
    candidates.clear();
    standing.clear();
  }

  /** @param {number[]} probabilities by object */
  function setProbabilities(probabilities) {
    thresholds = Array.from({ length: materials }, (_, m) => sumProbabilities(objects, probabilities, m));
    most = Math.max(...thresholds.map((sums) => sums[sums.length - 1]));
    clear();
  }
  setProbabilities(objects.map(({ probability }) => probability));

  return {
    setProbabilities,
    /** Compute all objects again. */
    clear,
    /** Cells around one whose classes have changed in which other objects may stand. */
    margin: rim + ring,
    /** Compute the objects again about a cell whose classes have changed. @param {number} i @param {number} j */
    forget(i, j) {
      for (let north = -rim - ring; north <= rim + ring; north++) {
        for (let east = -rim - ring; east <= rim + ring; east++) {
          standing.forget(i + east, j + north);
          if (Math.max(Math.abs(east), Math.abs(north)) <= rim) candidates.forget(i + east, j + north);
        }
      }
    },
    /** Objects that stand in a cell. @param {number} i @param {number} j @returns {Instance[]} */
    instancesIn: (i, j) => standing.get(i, j),
  };
}

/** Does a candidate go first? @param {Candidate} p @param {Candidate} q */
function leads(p, q) {
  if (p.priority !== q.priority) return p.priority > q.priority;
  return p.a !== q.a ? p.a > q.a : p.b > q.b;
}

/**
 * By object, the sum of the probabilities of those on a material up to it.
 *
 * @param {ScatterObject[]} objects @param {number[]} probabilities @param {number} m
 */
function sumProbabilities(objects, probabilities, m) {
  let sum = 0;
  return objects.map(({ material }, k) => (sum += material === m ? probabilities[k] : 0));
}

/**
 * The material with the highest score at a place, of equals the first.
 *
 * @param {import("./classes.js").Classes} classes @param {number} i @param {number} j
 * @param {number} u @param {number} v
 */
export function materialAt(classes, i, j, u, v) {
  const bits = classes.materialsIn(i, j);
  if (!(bits & (bits - 1))) return 31 - Math.clz32(bits);
  const scores = classes.scoresAt(i, j, u, v);
  let best = 0;
  for (let m = 1; m < scores.length; m++) if (scores[m] > scores[best]) best = m;
  return best;
}

/**
 * Does the score of the material exceed the others by the jitter's amplitude in four places of the footprint's rim?
 *
 * @param {import("./classes.js").Classes} classes @param {Instance} instance
 * @param {number} material
 */
function liesInside(classes, { i, j, u, v, radius }, material) {
  for (let k = 0; k < RIM.length; k++) {
    const x = u + RIM[k][0] * radius, y = v + RIM[k][1] * radius, right = Math.floor(x), up = Math.floor(y);
    if (classes.materialsIn(i + right, j + up) === 1 << material) continue;
    const scores = classes.scoresAt(i + right, j + up, x - right, y - up);
    for (let m = 0; m < scores.length; m++) {
      if (m !== material && !(scores[material] - scores[m] >= classes.amplitude)) return false;
    }
  }
  return true;
}

/**
 * An object that stands in a cell of the cache.
 *
 * @param {Instance} instance
 * @param {number} first number of the first object
 * @returns {Thing}
 */
export function createThing({ i, j, u, v, number, turn, size, radius }, first) {
  const angle = (turn * Math.PI) / 180;
  return {
    i, j, u, v, number, turn, size, radius, tile: first + number, tiles: [first + number], border: null,
    cos: Math.cos(angle), sin: Math.sin(angle), h: NaN, east: 0, north: 0,
    x: 0.5, y: 0.5, to: [0.5, 0.5, 0.5], distance: 0.5, nearest: 0.5, farthest: 0.5, lo: 0, hi: 0, whole: false,
    missing: 0, order: 0, direction: 0,
  };
}
