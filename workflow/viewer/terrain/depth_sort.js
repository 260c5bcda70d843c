// Sorting of Gaussians by depth: a stable radix sort of float bits.

const BITS = 11, DIGITS = 1 << BITS;

/**
 * A sorter with buffers of its own: `sort(depths, n)` gives the indices of the first n depths from back to front. The
 * result is overwritten by the next call.
 *
 * @typedef {(depths: Float32Array, n: number) => Uint32Array} DepthSorter
 * @returns {DepthSorter}
 */
export function createDepthSorter() {
  let keys = new Uint32Array(0), indices = [keys, keys];
  const counts = new Uint32Array(3 * DIGITS);
  return function sort(depths, n) {
    if (keys.length < n) {
      keys = new Uint32Array(2 * n);
      indices = [new Uint32Array(2 * n), new Uint32Array(2 * n)];
    }
    const bits = new Uint32Array(depths.buffer, depths.byteOffset, n);
    counts.fill(0);
    for (let k = 0; k < n; k++) {
      const b = bits[k];
      const key = b >>> 31 ? b : ~b & 0x7fffffff; // float bits as integers that rise as depths fall
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
