// The ground as others stand on it: height, normal, the cell there, and where a ray meets it.

import { REACH, tileUnder } from "../terrain/cells.js";
import { hitGround } from "../terrain/ray.js";
import { checkNumbers } from "./arguments.js";

/** @typedef {import("../scene/open_terrain.js").OpenTerrain} OpenTerrain */

/** @param {Pick<OpenTerrain, "manifest" | "heights" | "lift">} terrain */
export function createGround({ manifest, heights, lift }) {
  /** @param {number} x @param {number} y */
  const height = (x, y) => {
    checkNumbers("x, y", [x, y], 2);
    return heights.at(x, y)[0] + lift;
  };
  /** @param {number} x @param {number} y @returns {[number, number, number]} */
  const normal = (x, y) => {
    checkNumbers("x, y", [x, y], 2);
    const [, east, north] = heights.at(x, y), long = Math.hypot(east, north, 1);
    return [-east / long || 0, -north / long || 0, 1 / long];
  };
  return {
    height,
    normal,
    /** @param {number} x @param {number} y */
    cellAt(x, y) {
      checkNumbers("x, y", [x, y], 2);
      return tileUnder(manifest, heights, x, y);
    },
    /**
     * @param {ArrayLike<number>} origin
     * @param {ArrayLike<number>} direction
     * @param {number} [farthest]
     */
    pick(origin, direction, farthest = REACH * manifest.tile_side) {
      const from = checkNumbers("origin", origin, 3), way = checkNumbers("direction", direction, 3);
      const long = Math.hypot(...way);
      if (!(long > 0)) throw new TypeError("direction has no length");
      if (!Number.isFinite(farthest)) throw new TypeError("farthest: not a finite number");
      const hit = hitGround(from, way.map((v) => v / long), heights, { lift, farthest });
      if (!hit) return null;
      const [x, y] = hit, point = /** @type {[number, number, number]} */ ([x, y, height(x, y)]);
      const distance = Math.hypot(...point.map((v, k) => v - from[k]));
      return { point, normal: normal(x, y), distance, ...tileUnder(manifest, heights, x, y) };
    },
  };
}
