// A pool of equal pages of GPU memory; the least recently used entries are evicted when it is full.

/**
 * An entry: its pages, what its user counts in them, and when it was last used; -1: it was evicted.
 * @typedef {{ pages: Uint32Array, count: number, stamp: number }} PoolEntry
 */

/**
 * Stamps count views: what was used at the current stamp is never evicted.
 *
 * @param {number} capacity
 * @param {(key: number) => void} [onEvict]
 */
export function createPagePool(capacity, onEvict = () => {}) {
  const free = Uint32Array.from({ length: capacity }, (_, k) => capacity - 1 - k);
  /** @type {Map<number, PoolEntry>} */
  const entries = new Map();
  let left = capacity;
  /** @param {number} key */
  const evict = (key) => {
    const entry = entries.get(key);
    if (!entry) return;
    for (const page of entry.pages) free[left++] = page;
    entry.stamp = -1;
    entries.delete(key);
    onEvict(key);
  };
  /** @param {number} count @param {number} stamp */
  const makeRoom = (count, stamp) => {
    const old = [...entries].filter(([, entry]) => entry.stamp < stamp).sort((a, b) => a[1].stamp - b[1].stamp);
    for (const [key] of old) {
      if (left >= count) break;
      evict(key);
    }
    return left >= count;
  };
  return {
    /**
     * An entry, marked as used, or undefined.
     *
     * @param {number} key
     * @param {number} stamp
     */
    use(key, stamp) {
      const entry = entries.get(key);
      if (entry) entry.stamp = stamp;
      return entry;
    },
    /**
     * A new entry, or null where everything else is in use.
     *
     * @param {number} key
     * @param {number} many pages
     * @param {number} stamp
     * @param {number} count
     */
    allocate(key, many, stamp, count) {
      if (left < many && !makeRoom(many, stamp)) return null;
      const entry = { pages: free.slice(left - many, left).reverse(), count, stamp };
      left -= many;
      entries.set(key, entry);
      return entry;
    },
    /** Evict all entries with such keys. @param {(key: number) => boolean} matches */
    evictWhere(matches) {
      for (const key of [...entries.keys()]) if (matches(key)) evict(key);
    },
  };
}
