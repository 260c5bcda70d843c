// Draw order of cells and tiles: back to front, with little or no sorting; and a sort of Gaussians by depth.
// The same as dav_gswt/terrain/draw_order.py; tests/golden/draw_order.json holds both to it.

/** All steps at once. @template T @param {Generator<void, T>} steps @returns {T} */
export function run(steps) {
  for (;;) {
    const { done, value } = steps.next();
    if (done) return value;
  }
}

const BITS = 11, DIGITS = 1 << BITS; // of the radix sort
const STEP = 32768; // Gaussians

/**
 * Call `visit(di, dj)` for the cells of a window of `most` cells to every side of the eye's, back to front.
 *
 * A ray from the eye crosses cell edges only away from it, in i and in j: a cell with more steps |di| + |dj| never
 * hides one with fewer, and cells of equal steps never hide each other. Equal steps are visited by j, then by i.
 *
 * @param {number} most @param {(di: number, dj: number) => void} visit
 */
export function visitBackToFront(most, visit) {
  for (let steps = 2 * most; steps >= 0; steps--) {
    const tall = Math.min(steps, most);
    for (let dj = -tall; dj <= tall; dj++) {
      const wide = steps - Math.abs(dj);
      if (wide > most) continue;
      visit(-wide, dj);
      if (wide) visit(wide, dj);
    }
  }
}

/**
 * Is a cell in the 3 x 3 block about the eye's cell, which is drawn last and sorted by depth?
 *
 * @param {number} di @param {number} dj
 */
export const inNearBlock = (di, dj) => Math.abs(di) <= 1 && Math.abs(dj) <= 1;

/**
 * Position in `orders` of the pre-sorted order whose direction is nearest to the viewing direction on a surface with
 * slopes (east, north): the angle to (x + east z, y + north z, z) counts. Ties: the first.
 *
 * @param {number[][]} directions
 * @param {number[]} orders indices into directions, those that the tile keeps
 * @param {number[]} to from the eye to the tile's centre
 * @param {number} east @param {number} north
 */
export function nearestOrder(directions, orders, to, east, north) {
  const x = to[0] + east * to[2], y = to[1] + north * to[2], z = to[2];
  let best = 0, most = -Infinity;
  for (let k = 0; k < orders.length; k++) {
    const d = directions[orders[k]], along = d[0] * x + d[1] * y + d[2] * z;
    if (along > most) {
      best = k;
      most = along;
    }
  }
  return best;
}

/**
 * A stable radix sort of float bits, with buffers of its own: `sort(depths, n)` gives the indices of the first n depths
 * from back to front, `sort.steps` does so in steps. The next call overwrites the result.
 *
 * @typedef {ReturnType<typeof createDepthSorter>} DepthSorter
 */
export function createDepthSorter() {
  let keys = new Uint32Array(0), indices = [keys, keys];
  const counts = new Uint32Array(3 * DIGITS);
  /** @param {Float32Array} depths @param {number} n */
  function* steps(depths, n) {
    if (keys.length < n) {
      keys = new Uint32Array(2 * n);
      indices = [new Uint32Array(2 * n), new Uint32Array(2 * n)];
    }
    const bits = new Uint32Array(depths.buffer, depths.byteOffset, n);
    counts.fill(0);
    for (let k = 0; k < n;) {
      for (const end = Math.min(n, k + STEP); k < end; k++) {
        const b = bits[k];
        const key = b >>> 31 ? b : ~b & 0x7fffffff; // float bits as integers that rise as depths fall
        keys[k] = key;
        counts[key & (DIGITS - 1)]++;
        counts[DIGITS + ((key >>> BITS) & (DIGITS - 1))]++;
        counts[2 * DIGITS + (key >>> (2 * BITS))]++;
      }
      yield;
    }
    for (let pass = 0; pass < 3; pass++) {
      for (let digit = 0, sum = 0; digit < DIGITS; digit++) {
        const at = pass * DIGITS + digit, here = counts[at];
        counts[at] = sum;
        sum += here;
      }
    }
    let [from, to] = indices;
    for (let k = 0; k < n; k++) from[k] = k;
    for (let pass = 0; pass < 3; pass++) {
      const base = pass * DIGITS, shift = pass * BITS;
      for (let k = 0; k < n;) {
        for (const end = Math.min(n, k + STEP); k < end; k++) {
          const index = from[k];
          to[counts[base + ((keys[index] >>> shift) & (DIGITS - 1))]++] = index;
        }
        yield;
      }
      [from, to] = [to, from];
    }
    return from.subarray(0, n);
  }
  /** @param {Float32Array} depths @param {number} n */
  const sort = (depths, n) => run(steps(depths, n));
  return Object.assign(sort, { steps });
}
