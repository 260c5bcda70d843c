// In which order things are drawn so that what is nearer covers what is farther.
// The same as dav_gswt/terrain/order.py; tests/golden/draw_order.json holds both to it.

/**
 * Call `visit(di, dj)` for the cells of a window of `most` cells to every side of the eye's, back to front.
 *
 * A ray from the eye crosses cell edges only away from it, in i and in j: a cell with more steps |di| + |dj| never
 * hides one with fewer, and cells of equal steps hide nothing of each other. Equal steps are visited by j, then by i.
 */
export function backToFront(most, visit) {
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

/** The 3 x 3 cells about the eye's cell, which are drawn last and sorted exactly. */
export const around = (di, dj) => Math.abs(di) <= 1 && Math.abs(dj) <= 1;

/**
 * Position in `kept` of the order whose direction is nearest to the viewing direction `to` on a surface with slopes
 * (east, north): what counts is the angle to (x + east z, y + north z, z). Of equals the first.
 */
export function nearest(directions, kept, to, east, north) {
  const x = to[0] + east * to[2], y = to[1] + north * to[2], z = to[2];
  let best = 0, most = -Infinity;
  for (let k = 0; k < kept.length; k++) {
    const d = directions[kept[k]], along = d[0] * x + d[1] * y + d[2] * z;
    if (along > most) {
      best = k;
      most = along;
    }
  }
  return best;
}

const BITS = 11, DIGITS = 1 << BITS;

/** Sorts by depth with buffers that it keeps: `sorted(depths, n)` are the indices of n depths from back to front. */
export function createSorter() {
  let keys = new Uint32Array(0), indices = [keys, keys];
  const counts = new Uint32Array(3 * DIGITS);
  return function sorted(depths, n) {
    if (keys.length < n) {
      keys = new Uint32Array(2 * n);
      indices = [new Uint32Array(2 * n), new Uint32Array(2 * n)];
    }
    const bits = new Uint32Array(depths.buffer, depths.byteOffset, n);
    counts.fill(0);
    for (let k = 0; k < n; k++) {
      const b = bits[k];
      const key = b >>> 31 ? b : ~b & 0x7fffffff; // floats as integers that rise as depths fall
      keys[k] = key;
      counts[key & (DIGITS - 1)]++;
      counts[DIGITS + ((key >>> BITS) & (DIGITS - 1))]++;
      counts[2 * DIGITS + (key >>> (2 * BITS))]++;
    }
    for (let pass = 0; pass < 3; pass++) {
      for (let digit = 0, sum = 0; digit < DIGITS; digit++) {
        const at = pass * DIGITS + digit, here = counts[at];
        counts[at] = sum;
        sum += here;
      }
    }
    let [from, to] = indices;
    for (let k = 0; k < n; k++) to[counts[keys[k] & (DIGITS - 1)]++] = k;
    [from, to] = [to, from];
    for (let k = 0; k < n; k++) to[counts[DIGITS + ((keys[from[k]] >>> BITS) & (DIGITS - 1))]++] = from[k];
    [from, to] = [to, from];
    for (let k = 0; k < n; k++) to[counts[2 * DIGITS + (keys[from[k]] >>> (2 * BITS))]++] = from[k];
    return to.subarray(0, n);
  };
}
