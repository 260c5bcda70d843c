// A pool of equal pages of GPU memory; the least recently used entries are evicted when it is full.

/**
 * Stamps count views: what was used at the current stamp is never evicted.
 *
 * @param {number} capacity
 * @param {(key: number) => void} [onEvict]
 */
export function createPagePool(capacity, onEvict = () => {}) {
  const free = Uint32Array.from({ length: capacity }, (_, k) => capacity - 1 - k);
  /** @type {Map<number, { pages: Uint32Array, stamp: number }>} */
  const entries = new Map();
  let left = capacity;
  /** @param {number} key */
  const evict = (key) => {
    for (const page of entries.get(key)?.pages ?? []) free[left++] = page;
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
     * The pages of an entry, marked as used, or undefined.
     *
     * @param {number} key
     * @param {number} stamp
     */
    use(key, stamp) {
      const entry = entries.get(key);
      if (!entry) return undefined;
      entry.stamp = stamp;
      return entry.pages;
    },
    /**
     * Pages for a new entry, or null where everything else is in use.
     *
     * @param {number} key
     * @param {number} count
     * @param {number} stamp
     */
    allocate(key, count, stamp) {
      if (left < count && !makeRoom(count, stamp)) return null;
      const pages = free.slice(left - count, left).reverse();
      left -= count;
      entries.set(key, { pages, stamp });
      return pages;
    },
    /** Evict all entries with such keys. @param {(key: number) => boolean} matches */
    evictWhere(matches) {
      for (const key of [...entries.keys()]) if (matches(key)) evict(key);
    },
  };
}
