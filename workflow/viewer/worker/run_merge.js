// Merging of Gaussians that are in order already: runs of one chunk each become one list, back to front.

/**
 * What a run is taken from: see StoredChunk.
 * @typedef {{ centres: Float32Array, entries: Uint32Array, count: number }} RunChunk
 */

/** A merger with buffers of its own: `clear`, `add` for each run, `merge`. */
export function createRunMerger() {
  let depths = [new Float32Array(0), new Float32Array(0)], entries = [new Uint32Array(0), new Uint32Array(0)];
  let stays = new Uint8Array(0), n = 0, merged = 0;
  /** @type {number[]} */
  let ends = [];

  /** @param {number} most */
  function makeRoom(most) {
    if (depths[0].length >= most) return;
    const [old, before] = [depths[0], entries[0]];
    depths = [new Float32Array(2 * most), new Float32Array(2 * most)];
    entries = [new Uint32Array(2 * most), new Uint32Array(2 * most)];
    depths[0].set(old.subarray(0, n));
    entries[0].set(before.subarray(0, n));
  }

  /**
   * Merge two runs next to each other; of equal depths that of the first comes first.
   *
   * @param {number} begin
   * @param {number} middle
   * @param {number} end
   */
  function mergePair(begin, middle, end) {
    const [far, into] = depths, [from, to] = entries;
    let a = begin, b = middle, at = begin;
    while (a < middle && b < end) {
      const k = far[a] >= far[b] ? a++ : b++;
      into[at] = far[k];
      to[at++] = from[k];
    }
    const rest = a < middle ? a : b, until = a < middle ? middle : end;
    into.set(far.subarray(rest, until), at);
    to.set(from.subarray(rest, until), at);
  }

  return {
    clear() {
      n = 0;
      ends = [];
    },
    /**
     * Add a run: the Gaussians of a chunk in the order of `sequence`, or those of them that stay.
     *
     * @param {RunChunk} chunk
     * @param {ArrayLike<number>} sequence
     * @param {number[]} direction by which they are in order
     * @param {Uint32Array | null} kept indices of those that stay; null: all
     */
    add({ centres, entries: own, count }, sequence, [x, y, z], kept) {
      makeRoom(n + (kept ? kept.length : count));
      if (stays.length < count) stays = new Uint8Array(2 * count);
      if (kept) for (let m = 0; m < kept.length; m++) stays[kept[m]] = 1;
      const [far] = depths, [to] = entries, all = kept === null || kept.length === count;
      const most = kept && !kept.length ? 0 : count;
      for (let m = 0; m < most; m++) {
        const k = sequence[m];
        if (!all && !stays[k]) continue;
        far[n] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
        to[n++] = own[k];
      }
      if (kept) for (let m = 0; m < kept.length; m++) stays[kept[m]] = 0;
      if (n > (ends[ends.length - 1] ?? 0)) ends.push(n);
    },
    /** The entries of all runs, back to front; valid until the next call of any. */
    merge() {
      merged += n;
      while (ends.length > 1) {
        const longer = [];
        for (let k = 0, begin = 0; k < ends.length; k += 2) {
          const middle = ends[k], end = ends[k + 1] ?? middle;
          mergePair(begin, middle, end);
          longer.push(end);
          begin = end;
        }
        ends = longer;
        depths.reverse();
        entries.reverse();
      }
      return entries[0].subarray(0, n);
    },
    /** Gaussians that were merged so far. */
    get merged() {
      return merged;
    },
  };
}
