// Cells of a sphere that an eye may see, and their draw order. Port of dav_gswt/terrain/planet.py.

import { createRecentCache, RING } from "./caches.js";
import { REACH } from "./cells.js";
import { blankCell, createBallTest, frustumPlanes, RIM } from "./frustum.js";
import { directionOf, dot, FACES, QUARTER, rateOf, tangentAt } from "./sphere.js";
import { columnOf, isCovered, isFrayed, tileOn } from "./sphere_edges.js";

/**
 * @typedef {import("./frustum.js").Cell} Cell
 * @typedef {import("./sphere.js").Sphere} Sphere
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables
 *
 * Where a cell lies on a sphere: its face; tangents of its middle; the place of that on the ground, from the eye.
 * @typedef {{ face: number, s: number, t: number, centre: number[] }} Spot
 */

const CLIMB = 3; // times the reach on the ground by which the reach grows with the eye's height, at most
const MOST = RING * RING; // cells: the size of the cache
export const STRETCH = 1.3; // of a tile on the sphere, a little more than the most there is
const KNOWN = 1 << 16; // cells whose tile is remembered
const MOST_BORDERS = 20_000; // cells at edges whose Gaussians are remembered

/**
 * Distance to the last tiles: longer from above, where more of the ground is in view.
 *
 * @param {Pick<TerrainTables, "side">} terrain @param {Sphere} sphere @param {number[]} eye
 */
export function findReach({ side }, { radius }, eye) {
  const reach = REACH * side;
  return reach + Math.min(Math.max(Math.hypot(...eye) - radius, 0), CLIMB * reach);
}

/**
 * Where the last tiles are blended into the backdrop (end), and the sine of the angle there below the horizon (low);
 * see dav_gswt/terrain/backdrop.py.
 *
 * @param {Sphere} sphere @param {number[]} eye @param {number} reach
 */
export function findEnd({ radius }, eye, reach) {
  const far = Math.hypot(...eye), height = Math.max(far - radius, 0), square = height * (2 * radius + height);
  if (reach * reach >= square) return { end: 1e30, low: 1e-4 };
  return { end: reach, low: Math.max((square + reach * reach) / (2 * far * reach) - Math.sqrt(square) / far, 1e-4) };
}

/**
 * The eye's own cell in the grid of each face, +1 or -1 (the eye is behind the face: the order turns round), and the
 * face's place in the order of faces, from back to front.
 *
 * @param {{ cells: number }} sphere @param {number[]} eye
 */
export function aimFaces({ cells }, eye) {
  const along = FACES.map((axes) => axes.map((axis) => dot(axis, eye)));
  const order = FACES.map((_, face) => face).sort((a, b) => along[a][2] - along[b][2] || a - b);
  return along.map(([x, y, z], face) => {
    const sign = z < 0 ? -1 : 1;
    const [i, j] = [x, y].map((v) => Math.floor((Math.atan2(v * sign, Math.abs(z)) / QUARTER + 0.5) * cells));
    return { i, j, sign, place: order.indexOf(face) };
  });
}

/** Is a cell in the block about the eye that is sorted by depth? @param {ReturnType<typeof aimFaces>[0]} own @param {number} i @param {number} j */
export const isClose = (own, i, j) => own.sign > 0 && Math.abs(i - own.i) <= 1 && Math.abs(j - own.j) <= 1;

/**
 * Is cell a drawn before cell b? Negative: yes.
 *
 * @param {ReturnType<typeof aimFaces>} own @param {{ face: number, i: number, j: number }} a
 * @param {{ face: number, i: number, j: number }} b
 */
export function compareCells(own, a, b) {
  const one = own[a.face];
  if (a.face !== b.face) return one.place - own[b.face].place;
  const nearer = Math.abs(b.i - one.i) + Math.abs(b.j - one.j) - Math.abs(a.i - one.i) - Math.abs(a.j - one.j);
  return one.sign * nearer || a.j - b.j || a.i - b.i;
}

/**
 * A function as `cellsInFrustum` for a sphere. Each face is halved again and again, and a square is culled with all of
 * its cells where its bounding ball lies outside of one plane of the frustum, out of reach, or below the horizon.
 *
 * @param {TerrainTables} terrain @param {Sphere} sphere
 */
export function createSphereCells(terrain, sphere) {
  const { side, salt, variants, tiles, levels, cache } = terrain, { cells: n, radius } = sphere;
  const rate = rateOf(sphere, side), keys = new Float64Array(KNOWN).fill(NaN), numbers = new Uint16Array(KNOWN);
  /** @type {ReturnType<typeof createRecentCache<number, import("./cells.js").Border>>} */
  const borders = createRecentCache(MOST_BORDERS, () => 1);
  let serial = 0;

  /** @param {number} face @param {number} i @param {number} j */
  function tileIn(face, i, j) {
    const key = columnOf(sphere, face, i) * (n + 2) + j + 1, at = Math.floor(key % KNOWN);
    if (keys[at] !== key) {
      keys[at] = key;
      numbers[at] = tileOn(sphere, face, i, j, salt, variants);
    }
    return numbers[at];
  }

  /** @param {number} face @param {number} i @param {number} j */
  function borderOf(face, i, j) {
    if (!isFrayed(sphere, face, i, j)) return null;
    const column = columnOf(sphere, face, i), key = column * (n + 2) + j + 1, old = borders.get(key);
    return borders.keep(key, old
      ?? { i: column, j, serial: ++serial, kept: new Map(), last: null, batch: null, stale: false });
  }

  /** @param {Camera} camera @param {number} reach @returns {Cell[]} */
  return (camera, reach) => {
    const { eye } = camera, far = Math.hypot(...eye), own = aimFaces(sphere, eye), [low, high] = terrain.z;
    const isOutside = createBallTest(frustumPlanes(camera, terrain.near)), overhang = RIM * terrain.largest;
    const sky = acos((radius + low) / far) + acos((radius + low) / (radius + high)) + overhang / radius;
    const tall = Math.max(Math.abs(low), Math.abs(high)), up = eye.map((v) => v / far);
    const middle = [0, 0, 0], away = [0, 0, 0];
    /** @type {{ face: number, i: number, j: number, nearest: number, farthest: number, spot: Spot }[]} */
    const found = [];

    /** @param {number} face @param {number} i @param {number} j @param {number} size */
    function visit(face, i, j, size) {
      if (i > n || j > n || (size === 1 && !isCovered(sphere, face, i, j))) return;
      const s = tangentAt(0.5 * (i + Math.min(i + size, n + 1)), n), t = tangentAt(0.5 * (j + Math.min(j + size, n + 1)), n);
      directionOf(face, s, t, middle);
      for (let k = 0; k < 3; k++) away[k] = radius * middle[k] - eye[k];
      const chord = Math.min(STRETCH * Math.SQRT1_2 * size * side * rate, 2), ball = radius * chord + tall;
      const distance = Math.hypot(away[0], away[1], away[2]), wide = ball + overhang;
      if (distance - ball >= reach || isOutside(away, wide)) return;
      const apart = Math.hypot(middle[0] - up[0], middle[1] - up[1], middle[2] - up[2]);
      if (angleOf(apart) - angleOf(chord) > sky) return;
      if (size === 1) {
        found.push({
          face, i, j, nearest: Math.max(distance - ball, 0), farthest: distance + ball,
          spot: { face, s, t, centre: [...away] },
        });
        return;
      }
      const half = size / 2;
      visit(face, i, j, half);
      visit(face, i + half, j, half);
      visit(face, i, j + half, half);
      visit(face, i + half, j + half, half);
    }

    let size = 1;
    while (size < n + 2) size *= 2;
    for (let face = 0; face < 6; face++) visit(face, -1, -1, size);
    if (found.length > MOST) { // the nearest
      found.sort((a, b) => a.nearest - b.nearest);
      found.length = MOST;
    }
    found.sort((a, b) => compareCells(own, a, b));
    while (terrain.cells.length < found.length) terrain.cells.push(blankCell());
    found.forEach(({ face, i, j, nearest, farthest, spot }, at) => {
      const tile = tileIn(face, i, j), cell = terrain.cells[at], { counts, alone } = tiles[tile];
      for (let level = 0; level < levels; level++) cache.counts[at * levels + level] = counts[level];
      Object.assign(cell, {
        di: columnOf(sphere, face, i), dj: j, at, tile, tiles: alone, border: borderOf(face, i, j), nearest, farthest,
        close: isClose(own[face], i, j), spot,
      });
    });
    return terrain.cells.slice(0, found.length);
  };
}

/** @param {number} x */
const acos = (x) => Math.acos(Math.min(Math.max(x, -1), 1));
/** @param {number} chord */
const angleOf = (chord) => 2 * Math.asin(Math.min(0.5 * chord, 1));
