// Uncertainty of tiles on the scale of a set: tiles of one set differ by little against the whole range from 0 to 1.

/**
 * Least and largest uncertainty of a set.
 *
 * @param {{ uncertainty?: number }[]} tiles
 * @returns {[number, number]}
 */
export function uncertaintyRange(tiles) {
  const values = tiles.map(({ uncertainty }) => uncertainty ?? 0);
  return [Math.min(...values), Math.max(...values)];
}

/**
 * Where a value lies between the ends of a range, 0 to 1; in the middle of a range without extent.
 *
 * @param {number} value
 * @param {[number, number]} range
 */
export const shareOfRange = (value, [low, high]) => (high > low ? Math.min(Math.max((value - low) / (high - low), 0), 1) : 0.5);
