// What a frame draws, cell by cell.

import { NO_ORDER } from "../data/layout.js";

/**
 * i, j: the cell; tile: the one in it, of the first material that shows; level to last: the levels of detail that are
 * drawn; order: index of the direction of its pre-sorted order, NO_ORDER where it is sorted by depth.
 * @typedef {{ i: number, j: number, tile: number, level: number, last: number, order: number }} DrawnCell
 */

export { NO_ORDER };

/**
 * The cells of a frame, back to front.
 *
 * @param {import("../worker/frame_builder.js").FrameAnswer} frame
 * @returns {DrawnCell[]}
 */
export function listDrawnCells({ drawn, i0, j0 }) {
  const cells = [];
  for (let k = 0; k < drawn.length; k += 6) {
    const [di, dj, tile, level, last, order] = drawn.subarray(k, k + 6);
    cells.push({ i: i0 + di, j: j0 + dj, tile, level, last, order });
  }
  return cells;
}
