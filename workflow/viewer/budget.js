// What to draw of the cells in sight within a budget of Gaussians: the levels of each, and how far out the ground goes.
//
// Over the budget all level distances shrink by one factor, so that every place is drawn coarser by as much, and the
// far ground, which is thin in the picture, comes nearer by less. A level whose distance has become less than the eye's
// height over the ground is not drawn at all: the next coarser one takes its place, also underfoot. So ground covers
// the picture whatever the budget is.

import { inSight } from "./sight.js";
import { REACH } from "./terrain.js";

// Exponent: the reach shrinks by the factor's fifth root. Desert, for development, 20k and 50k Gaussians: against 1/2 a
// walker's picture loses 0.46 and 0.44 dB and one from six times as high gains 0.64 and 0.45; against 0, with the far
// ground always there, the walker's gains 0.03 and 0.65 and the other loses 0 and 0.07.
const NEARER = 1 / 5;
const HALVINGS = 12; // steps of the search for the factor
const NEVER = -1; // distance to which a level is drawn that is not drawn

/**
 * Cells back to front with the levels lo to hi that have a weight in them; `shrink`, the factor on level distances;
 * `switches` and `bands`, these distances; the reach; and chunks (16 tile + level) that are lacking.
 */
export function visible(terrain, camera, budget) {
  const cells = inSight(terrain, camera, REACH * terrain.side), above = heightOf(terrain, camera);
  const cost = (drawn) => cells.reduce((sum, cell) => (chooseLevels(terrain, cell, drawn) ? sum + cell.count : sum), 0);
  let drawn = drawnAt(terrain, above, 1);
  if (cost(drawn) > budget) {
    let low = Math.log(leastShrink(terrain, above)), high = 0;
    for (let k = 0; k < HALVINGS; k++) {
      const middle = (low + high) / 2;
      if (cost(drawnAt(terrain, above, Math.exp(middle))) <= budget) low = middle;
      else high = middle;
    }
    drawn = drawnAt(terrain, above, Math.exp(low));
  }
  const kept = cells.filter((cell) => chooseLevels(terrain, cell, drawn));
  return { ...drawn, ...nearestOf(kept, budget, drawn.reach), missing: lacking(kept) };
}

/** Level distances and reach under a factor. */
function drawnAt({ switches, bands, side }, above, shrink) {
  const used = switches.map((distance, l) => shrink === 1 || shrink * (distance + bands[l]) >= above);
  return {
    shrink,
    switches: switches.map((distance, l) => (used[l] ? shrink * distance : NEVER)),
    bands: bands.map((band, l) => (used[l] ? shrink * band : 0)),
    reach: REACH * side * shrink ** NEARER,
  };
}

/** The factor under which only the coarsest level is drawn. */
function leastShrink({ switches, bands }, above) {
  const farthest = switches.slice(0, -1).map((distance, l) => distance + bands[l]);
  return Math.min(1, (0.99 * above) / Math.max(above, ...farthest));
}

/** How high the eye is over the ground; it is never below. */
function heightOf({ heights, near }, { eye: [x, y, z] }) {
  return Math.max(near, z - heights.at(x, y)[0]);
}

/**
 * Set a cell's levels, lo to hi, and their count; where one of them has not arrived, one that has stands in for all
 * (`whole`: it does not fade), the next coarser first. Returns: is there anything to draw?
 */
function chooseLevels({ tiles, levels }, cell, { switches, bands, reach }) {
  if (cell.nearest >= reach) return false;
  const { counts, arrived } = tiles[cell.tile];
  let lo = 0, hi = 0;
  while (lo < levels - 1 && cell.nearest > switches[lo] + bands[lo]) lo += 1;
  for (hi = lo; hi < levels - 1 && cell.farthest >= switches[hi] - bands[hi];) hi += 1;
  const wanted = (2 << hi) - (1 << lo);
  cell.lacking = wanted & ~arrived;
  cell.whole = cell.lacking !== 0;
  if (cell.whole) {
    let level = lo;
    while (level < levels && !((arrived >> level) & 1)) level += 1;
    if (level === levels) for (level = lo - 1; level >= 0 && !((arrived >> level) & 1);) level -= 1;
    if (level < 0) return false;
    lo = hi = level;
  }
  cell.lo = lo;
  cell.hi = hi;
  cell.count = 0;
  for (let level = lo; level <= hi; level++) cell.count += counts[level];
  return true;
}

/** Chunks that are wanted and have not arrived. */
function lacking(cells) {
  const missing = new Set();
  for (const { tile, lacking: levels } of cells) {
    for (let level = 0; levels >> level; level++) if ((levels >> level) & 1) missing.add(16 * tile + level);
  }
  return missing;
}

/** Where even the coarsest levels are too many: the cells nearest to the eye, at least one, and how far they go. */
function nearestOf(cells, budget, reach) {
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
