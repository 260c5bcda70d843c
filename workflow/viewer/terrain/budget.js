// Level of detail within a budget of Gaussians: the levels of each cell in view, and the distance to the last cells.
//
// Over the budget all level distances are multiplied by one factor, so every place is drawn coarser by as much, and the
// last cells come nearer by less. A level whose distance falls below the eye's height above the ground is replaced by
// the next coarser one everywhere, so ground covers the picture under any budget.
//
// In a set that does not fit into the chunk cache, a second factor limits the chunks that a view needs to a part of the
// cache. Both factors then depend on the camera alone, not on what is at hand: at rest each chunk is composed once.
//
// And placement of objects: which are drawn with which cell, at which levels and in which order, as in
// dav_gswt/terrain/placement.py.

import { RING } from "./caches.js";
import { REACH } from "./cells.js";
import { nearestOrder } from "./draw_order.js";
import { cellsInFrustum, createBallTest, frustumPlanes } from "./frustum.js";
import { findReach } from "./sphere_cells.js";

/**
 * @typedef {import("./frustum.js").Cell} Cell
 * @typedef {import("./scatter.js").Thing} Thing
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables
 *
 * Level distances and reach under a factor.
 * @typedef {{ shrink: number, switches: number[], bands: number[], reach: number }} Distances
 *
 * What to draw: cells back to front, their number of Gaussians, and missing chunks (16 tile + level). shrink: the factor
 * that the budget asks for.
 * @typedef {Distances & { cells: Cell[], count: number, missing: Set<number> }} Selection
 */

const REACH_EXPONENT = 1 / 5; // the reach shrinks by the factor to this power, chosen by measurement
const BISECTIONS = 12; // of the search for the factor
const ALL = -1; // bits of levels
const NEVER = -1; // switch distance of a level that is not used

/**
 * The cells and levels to draw from a camera, with at most `budget` Gaussians where the coarsest levels allow it.
 *
 * @param {TerrainTables} terrain @param {Camera} camera @param {number} budget
 * @returns {Selection}
 */
export function selectCells(terrain, camera, budget) {
  const { sphere, sphereCells, side } = terrain, above = eyeHeight(terrain, camera);
  const least = sphere ? above : 0, reach = sphere ? findReach(terrain, sphere, camera.eye) : REACH * side;
  const cells = sphereCells ? sphereCells(camera, reach) : cellsInFrustum(terrain, camera, reach);
  for (const cell of cells) cell.arrived = terrain.room ? ALL : arrivedLevels(terrain, cell.tiles);
  /** @param {Distances} distances */
  const cost = (distances) =>
    cells.reduce((sum, cell) => (chooseLevels(terrain, cell, distances) ? sum + cell.count : sum), 0);
  /** @param {number} shrink */
  const at = (shrink) => distancesAt(terrain, above, [least, reach], shrink);
  const smallest = leastShrink(terrain, above);
  const shrink = largestFactor(smallest, 1, (factor) => cost(at(factor)) <= budget);
  let distances = at(shrink);
  if (terrain.room) {
    const fitting = largestFactor(smallest, shrink, (factor) => fitsRoom(terrain, cells, at(factor)));
    distances = { ...at(fitting), shrink, reach: distances.reach };
    setWish(terrain, cells, distances);
    for (const cell of cells) cell.arrived = arrivedLevels(terrain, cell.tiles);
  }
  const kept = cells.filter((cell) => chooseLevels(terrain, cell, distances));
  const missing = terrain.room ? missingWishes(terrain) : missingChunks(terrain, kept);
  return { ...distances, ...nearestCells(kept, budget, distances.reach), missing };
}

/**
 * The largest factor between two that passes a test; the smallest factor counts as passing.
 *
 * @param {number} smallest @param {number} largest @param {(factor: number) => boolean} passes
 */
function largestFactor(smallest, largest, passes) {
  if (smallest >= largest || passes(largest)) return largest;
  let low = Math.log(smallest), high = Math.log(largest);
  for (let k = 0; k < BISECTIONS; k++) {
    const middle = (low + high) / 2;
    if (passes(Math.exp(middle))) low = middle;
    else high = middle;
  }
  return Math.exp(low);
}

/**
 * @param {TerrainTables} terrain
 * @param {number} above height of the eye over the ground
 * @param {number[]} reaches under the smallest and under a factor of 1
 * @param {number} shrink
 * @returns {Distances}
 */
function distancesAt({ switches, bands }, above, [least, reach], shrink) {
  const used = switches.map((distance, l) => shrink === 1 || shrink * (distance + bands[l]) >= above);
  return {
    shrink,
    switches: switches.map((distance, l) => (used[l] ? shrink * distance : NEVER)),
    bands: bands.map((band, l) => (used[l] ? shrink * band : 0)),
    reach: least + (reach - least) * shrink ** REACH_EXPONENT,
  };
}

/**
 * The factor under which only the coarsest level is drawn.
 *
 * @param {TerrainTables} terrain @param {number} above
 */
function leastShrink({ switches, bands }, above) {
  const farthest = switches.slice(0, -1).map((distance, l) => distance + bands[l]);
  return Math.min(1, (0.99 * above) / Math.max(above, ...farthest));
}

/**
 * Height of the eye over the ground; at least the near plane's distance.
 *
 * @param {TerrainTables} terrain @param {Camera} camera
 */
function eyeHeight({ heights, near, sphere }, { eye: [x, y, z] }) {
  if (sphere) return Math.max(near, Math.hypot(x, y, z) - sphere.radius);
  return Math.max(near, z - heights.at(x, y)[0]);
}

/** Bits of the levels that have arrived of all tiles. @param {TerrainTables} terrain @param {number[]} numbers */
function arrivedLevels({ tiles }, numbers) {
  let arrived = -1;
  for (let k = 0; k < numbers.length; k++) arrived &= tiles[numbers[k]].arrived;
  return arrived;
}

/**
 * Set the wish of a view: the levels of each tile and object that it shows when all of them have arrived. An object's
 * levels are taken from the distances of its cell, widened by the object's extent.
 *
 * @param {TerrainTables} terrain
 * @param {Cell[]} cells with all levels
 * @param {Distances} distances
 */
function setWish(terrain, cells, { switches, bands, reach }) {
  const { wish, objects, heights } = terrain;
  const span = { nearest: 0, farthest: 0, lo: 0, hi: 0, whole: false, missing: 0 };
  wish.fill(0);
  for (const cell of cells) {
    if (cell.nearest >= reach) continue;
    if (pickLevels(terrain, cell, cell.arrived, switches, bands)) {
      for (const tile of cell.tiles) wish[tile] |= (2 << cell.hi) - (1 << cell.lo);
    }
    for (const { tile, number, size } of cell.things) {
      const extent = objects[number].extent * size * (1 + heights.steepest);
      span.nearest = cell.nearest - extent;
      span.farthest = cell.farthest + extent;
      if (pickLevels(terrain, span, ALL, switches, bands)) wish[tile] |= (2 << span.hi) - (1 << span.lo);
    }
  }
}

/**
 * Do the chunks that a view needs fit into its room, beside the coarsest level?
 *
 * @param {TerrainTables} terrain @param {Cell[]} cells @param {Distances} distances
 */
function fitsRoom(terrain, cells, distances) {
  const { tiles, wish, room, levels } = terrain;
  setWish(terrain, cells, distances);
  let bytes = 0, rows = 0;
  for (let tile = 0; tile < tiles.length; tile++) {
    for (let level = 0; level < levels - 1; level++) {
      if (!((wish[tile] >> level) & 1)) continue;
      bytes += tiles[tile].bytes[level];
      rows += tiles[tile].rows[level];
    }
  }
  return room === null || (bytes <= room.bytes && rows <= room.rows);
}

/**
 * Set a cell's levels and their count. Returns: is there anything to draw?
 *
 * @param {TerrainTables} terrain @param {Cell} cell @param {Distances} distances
 */
function chooseLevels(terrain, cell, { switches, bands, reach }) {
  if (cell.nearest >= reach) return false;
  if (!pickLevels(terrain, cell, cell.arrived, switches, bands)) return false;
  const { counts } = terrain.cache, first = cell.at * terrain.levels;
  cell.count = 0;
  for (let level = cell.lo; level <= cell.hi; level++) cell.count += counts[first + level];
  return true;
}

/**
 * Set the levels lo to hi of what lies between two distances; where one of them has not arrived, one that has stands in
 * for all, the next coarser first. Returns: is there anything to draw?
 *
 * @param {TerrainTables} terrain
 * @param {{ nearest: number, farthest: number, lo: number, hi: number, whole: boolean, missing: number }} span
 * @param {number} arrived bits of levels
 * @param {number[]} switches @param {number[]} bands
 */
export function pickLevels({ levels }, span, arrived, switches, bands) {
  let lo = 0, hi = 0;
  while (lo < levels - 1 && span.nearest > switches[lo] + bands[lo]) lo += 1;
  for (hi = lo; hi < levels - 1 && span.farthest >= switches[hi] - bands[hi];) hi += 1;
  const wanted = (2 << hi) - (1 << lo);
  span.missing = wanted & ~arrived;
  span.whole = span.missing !== 0;
  if (span.whole) {
    let level = lo;
    while (level < levels && !((arrived >> level) & 1)) level += 1;
    if (level === levels) for (level = lo - 1; level >= 0 && !((arrived >> level) & 1);) level -= 1;
    if (level < 0) return false;
    lo = hi = level;
  }
  span.lo = lo;
  span.hi = hi;
  return true;
}

/** Chunks that the wish of a view names and that have not arrived. @param {TerrainTables} terrain */
function missingWishes({ tiles, wish }) {
  /** @type {Set<number>} */
  const chunks = new Set();
  for (let tile = 0; tile < tiles.length; tile++) addMissing(chunks, tile, wish[tile] & ~tiles[tile].arrived);
  return chunks;
}

/** @param {TerrainTables} terrain @param {Cell[]} cells */
function missingChunks(terrain, cells) {
  /** @type {Set<number>} */
  const chunks = new Set();
  for (const { tiles, missing } of cells) {
    if (missing) for (const tile of tiles) addMissing(chunks, tile, missing & ~terrain.tiles[tile].arrived);
  }
  return chunks;
}

/**
 * Add the keys of missing levels of a tile or an object.
 *
 * @param {Set<number>} chunks @param {number} tile
 * @param {number} missing bits of levels
 */
export function addMissing(chunks, tile, missing) {
  for (let level = 0; missing >> level; level++) if ((missing >> level) & 1) chunks.add(16 * tile + level);
}

/**
 * Where even the coarsest levels exceed the budget: the cells nearest to the eye, at least one, and their reach.
 *
 * @param {Cell[]} cells @param {number} budget @param {number} reach
 */
function nearestCells(cells, budget, reach) {
  let count = cells.reduce((sum, cell) => sum + cell.count, 0);
  if (count <= budget || !cells.length) return { cells, count, reach };
  const nearestFirst = [...cells].sort((a, b) => a.nearest - b.nearest);
  let kept = 0;
  for (count = 0; kept < cells.length && (!kept || count + nearestFirst[kept].count <= budget); kept++) {
    count += nearestFirst[kept].count;
  }
  const chosen = new Set(nearestFirst.slice(0, kept));
  return { cells: cells.filter((cell) => chosen.has(cell)), count, reach: nearestFirst[kept]?.nearest ?? reach };
}

/**
 * The objects in view of cells, by the index of the cell that each is drawn with, by falling distance; null: none.
 *
 * An object reaches over the edges of its own cell. Of the cells that its footprint touches, the one nearest to the eye
 * is drawn last, and the object right after it: else the ground of a nearer cell would cover what hangs over it. Where
 * that cell is not visible, the object is drawn with its own.
 *
 * @param {TerrainTables} terrain @param {import("./camera.js").Camera} camera
 * @param {Selection} selection
 */
export function placeObjects(terrain, camera, { cells, switches, bands, missing }) {
  /** @type {(Thing[] | null)[]} */
  const groups = new Array(cells.length).fill(null);
  if (!terrain.scatter) return groups;
  const isOutside = createBallTest(frustumPlanes(camera, terrain.near)), drawnWith = terrain.window.fill(-1);
  const { eye } = camera;
  const i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
  for (let k = 0; k < cells.length; k++) drawnWith[windowIndex(cells[k].di, cells[k].dj)] = k;
  for (let k = 0; k < cells.length; k++) {
    for (const thing of cells[k].things) {
      const { arrived } = terrain.tiles[thing.tile];
      aimThing(thing, terrain, eye, i0, j0);
      if (isOutside(thing.to, thing.farthest - thing.distance)) continue;
      const drawn = pickLevels(terrain, thing, arrived, switches, bands);
      if (thing.missing && !terrain.room) addMissing(missing, thing.tile, thing.missing);
      if (!drawn) continue;
      orderThing(thing, terrain);
      const east = nearestTouched(thing.i - i0, thing.u, thing.radius);
      const north = nearestTouched(thing.j - j0, thing.v, thing.radius);
      const found = drawnWith[windowIndex(east, north)], owner = found < 0 ? k : found, group = groups[owner];
      if (group) insertByDistance(group, thing);
      else groups[owner] = [thing];
    }
  }
  return groups;
}

/** Add an object to a list by falling distance, after those at its own. @param {Thing[]} group @param {Thing} thing */
function insertByDistance(group, thing) {
  let at = group.push(thing) - 1;
  for (; at > 0 && group[at - 1].distance < thing.distance; at--) group[at] = group[at - 1];
  group[at] = thing;
}

/** @param {number} di @param {number} dj */
const windowIndex = (di, dj) => (dj & (RING - 1)) * RING + (di & (RING - 1));

/**
 * Of the cells along an axis that a footprint touches, counted from the eye's, the one nearest to the eye.
 *
 * @param {number} cell
 * @param {number} place in it
 * @param {number} radius
 */
const nearestTouched = (cell, place, radius) => (
  Math.min(Math.max(0, cell + Math.floor(place - radius)), cell + Math.floor(place + radius)));

/**
 * Foot and distances of an object, seen from the eye.
 *
 * @param {Thing} thing @param {TerrainTables} terrain @param {number[]} eye @param {number} i0
 * @param {number} j0
 */
function aimThing(thing, { side, heights, objects }, eye, i0, j0) {
  const { i, j, u, v, number, size, to } = thing;
  if (Number.isNaN(thing.h)) [thing.h, thing.east, thing.north] = heights.at((i + u) * side, (j + v) * side);
  thing.x = i - i0 + u;
  thing.y = j - j0 + v;
  to[0] = thing.x * side + (i0 * side - eye[0]);
  to[1] = thing.y * side + (j0 * side - eye[1]);
  to[2] = objects[number].ground + thing.h - eye[2];
  const reach = objects[number].extent * size * (1 + heights.steepest);
  thing.distance = Math.sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
  thing.nearest = thing.distance - reach;
  thing.farthest = thing.distance + reach;
}

/**
 * The order nearest to the viewing direction, turned back as the object is turned.
 *
 * @param {Thing} thing @param {TerrainTables} terrain
 */
function orderThing(thing, { tiles, directions }) {
  const { cos, sin, to: [x, y, z], east, north, tile } = thing, { orders } = tiles[tile];
  const back = [cos * x + sin * y, cos * y - sin * x, z];
  thing.order = nearestOrder(directions, orders, back, cos * east + sin * north, cos * north - sin * east);
  thing.direction = orders[thing.order];
}
