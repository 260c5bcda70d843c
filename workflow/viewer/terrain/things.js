// Objects in cells, as the cache of cells keeps them and views aim them.

/**
 * An object in a cell, and what the last view made of it. tile, tiles: its number after all tiles; border: none; cos,
 * sin: of its turn; h, east, north: surface under its foot; x, y: of the foot, in cells from the eye's; to: from the
 * eye to the foot; nearest, farthest: bounds of the distances of its Gaussians; lo to hi, whole, missing: as of a cell;
 * order: position among the orders that it keeps, and direction: which that is.
 * @typedef {import("./scatter.js").Instance & { tile: number, tiles: number[], border: null, cos: number, sin: number,
 *   h: number, east: number, north: number, x: number, y: number, to: number[], distance: number, nearest: number,
 *   farthest: number, lo: number, hi: number, whole: boolean, missing: number, order: number,
 *   direction: number }} Thing
 */

/**
 * An object that stands in a cell of the cache.
 *
 * @param {import("./scatter.js").Instance} instance
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
