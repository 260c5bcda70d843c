// Storage by cell, for the cells about a moving eye: coordinates modulo RING, so a cell stays while it is in reach.

export const RING = 128; // cells along a side: a power of 2, more than twice the reach

/**
 * Values of cells; what entered first gives way to a cell RING steps away.
 *
 * @template T
 * @param {(i: number, j: number) => T} compute the value of a cell that enters
 */
export function createCellRing(compute) {
  const i = new Float64Array(RING * RING).fill(NaN), j = new Float64Array(RING * RING);
  /** @type {T[]} */
  const values = new Array(RING * RING);
  return {
    /**
     * @param {number} x
     * @param {number} y
     * @returns {T}
     */
    get(x, y) {
      const at = (y & (RING - 1)) * RING + (x & (RING - 1));
      if (i[at] !== x || j[at] !== y) {
        values[at] = compute(x, y);
        i[at] = x;
        j[at] = y;
      }
      return values[at];
    },
    /** Compute a cell again when it is next asked for. @param {number} x @param {number} y */
    forget(x, y) {
      const at = (y & (RING - 1)) * RING + (x & (RING - 1));
      if (i[at] === x && j[at] === y) i[at] = NaN;
    },
    /** Compute all cells again. */
    clear() {
      i.fill(NaN);
    },
  };
}
