// What a person changes of the terrain while it is shown: painted places, shares of materials, densities of objects.
// Cells that are not touched keep all that was made for them.

import { forgetCells } from "../terrain/cells.js";

/**
 * Paint points of the lattice of scores, and forget the cells about them.
 *
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {Int32Array} points I, J and material (-1: as the rule) of each
 */
export function paintPoints({ classes, scatter, cache }, points) {
  if (!classes) return;
  /** @type {Map<string, [number, number]>} */
  const touched = new Map();
  for (let k = 0; k < points.length; k += 3) {
    const i = points[k], j = points[k + 1];
    classes.painted.set(i, j, points[k + 2]);
    for (const [a, b] of classes.painted.cellsAround(i, j)) touched.set(`${a},${b}`, [a, b]);
  }
  const margin = scatter?.margin ?? 0;
  for (const [i, j] of touched.values()) {
    classes.forget(i, j);
    scatter?.forget(i, j);
    for (let b = j - margin; b <= j + margin; b++) {
      for (let a = i - margin; a <= i + margin; a++) forgetCells(cache, a === i && b === j, [a, b]);
    }
  }
}

/**
 * Change what the noise of the rule adds to each material, and the probabilities of the objects.
 *
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {{ offsets: number[] | null, probabilities: number[] | null }} changes null: as they are
 */
export function adjustCover({ classes, scatter, cache }, { offsets, probabilities }) {
  if (offsets) classes?.setOffsets(offsets);
  if (scatter && probabilities) scatter.setProbabilities(probabilities);
  else if (scatter && offsets) scatter.clear();
  forgetCells(cache, offsets !== null);
}
