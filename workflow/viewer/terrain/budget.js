// Level of detail within a budget of Gaussians: the levels of each cell in view, and the distance to the last cells.
//
// Over the budget all level distances are multiplied by one factor, so every place is drawn coarser by as much, and the
// last cells come nearer by less. A level whose distance falls below the eye's height above the ground is replaced by
// the next coarser one everywhere, so ground covers the picture under any budget.

import { REACH } from "./cells.js";
import { cellsInFrustum } from "./frustum.js";
import { findReach } from "./sphere_cells.js";

/**
 * @typedef {import("./frustum.js").Cell} Cell
 * @typedef {import("./camera.js").Camera} Camera
 * @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables
 *
 * Level distances and reach under a factor.
 * @typedef {{ shrink: number, switches: number[], bands: number[], reach: number }} Distances
 *
 * What to draw: cells back to front, their number of Gaussians, and missing chunks (16 tile + level).
 * @typedef {Distances & { cells: Cell[], count: number, missing: Set<number> }} Selection
 */

const REACH_EXPONENT = 1 / 5; // the reach shrinks by the factor to this power: docs/research/lab-notes.md
const BISECTIONS = 12; // of the search for the factor
const NEVER = -1; // switch distance of a level that is not used

/**
 * The cells and levels to draw from a camera, with at most `budget` Gaussians where the coarsest levels allow it.
 *
 * @param {TerrainTables} terrain
 * @param {Camera} camera
 * @param {number} budget
 * @returns {Selection}
 */
export function selectCells(terrain, camera, budget) {
  const { sphere, sphereCells, side } = terrain, above = eyeHeight(terrain, camera);
  const least = sphere ? above : 0, reach = sphere ? findReach(terrain, sphere, camera.eye) : REACH * side;
  const cells = sphereCells ? sphereCells(camera, reach) : cellsInFrustum(terrain, camera, reach);
  for (const cell of cells) cell.arrived = arrivedLevels(terrain, cell.tiles);
  /** @param {Distances} distances */
  const cost = (distances) =>
    cells.reduce((sum, cell) => (chooseLevels(terrain, cell, distances) ? sum + cell.count : sum), 0);
  let distances = distancesAt(terrain, above, [least, reach], 1);
  if (cost(distances) > budget) {
    let low = Math.log(leastShrink(terrain, above)), high = 0;
    for (let k = 0; k < BISECTIONS; k++) {
      const middle = (low + high) / 2;
      if (cost(distancesAt(terrain, above, [least, reach], Math.exp(middle))) <= budget) low = middle;
      else high = middle;
    }
    distances = distancesAt(terrain, above, [least, reach], Math.exp(low));
  }
  const kept = cells.filter((cell) => chooseLevels(terrain, cell, distances));
  return { ...distances, ...nearestCells(kept, budget, distances.reach), missing: missingChunks(terrain, kept) };
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
 * @param {TerrainTables} terrain
 * @param {number} above
 */
function leastShrink({ switches, bands }, above) {
  const farthest = switches.slice(0, -1).map((distance, l) => distance + bands[l]);
  return Math.min(1, (0.99 * above) / Math.max(above, ...farthest));
}

/**
 * Height of the eye over the ground; at least the near plane's distance.
 *
 * @param {TerrainTables} terrain
 * @param {Camera} camera
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
 * Set a cell's levels and their count. Returns: is there anything to draw?
 *
 * @param {TerrainTables} terrain
 * @param {Cell} cell
 * @param {Distances} distances
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
 * @param {number[]} switches
 * @param {number[]} bands
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
 * @param {Set<number>} chunks
 * @param {number} tile
 * @param {number} missing bits of levels
 */
export function addMissing(chunks, tile, missing) {
  for (let level = 0; missing >> level; level++) if ((missing >> level) & 1) chunks.add(16 * tile + level);
}

/**
 * Where even the coarsest levels exceed the budget: the cells nearest to the eye, at least one, and their reach.
 *
 * @param {Cell[]} cells
 * @param {number} budget
 * @param {number} reach
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
