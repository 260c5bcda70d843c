// Caches: of cells about a moving eye, by their coordinates modulo RING, so that a cell stays while it is in reach; of
// anything that was used recently; and of pages of GPU memory.

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
    /** @param {number} x @param {number} y @returns {T} */
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

/**
 * Values by key. The most recently used stay while their sizes sum to no more than `most`, and the last one always.
 *
 * @template K, T
 * @param {number} most @param {(value: T) => number} sizeOf @param {(key: K) => void} [onForget]
 */
export function createRecentCache(most, sizeOf, onForget = () => {}) {
  /** @type {Map<K, T>} */
  const known = new Map(); // the latest last
  let size = 0;
  /** @param {K} key */
  const remove = (key) => {
    const old = known.get(key);
    if (old !== undefined) size -= sizeOf(old);
    known.delete(key);
  };
  /** @param {K} key */
  const forget = (key) => {
    remove(key);
    onForget(key);
  };
  return {
    /** @param {K} key */
    get: (key) => known.get(key),
    /** Keep a value as the latest. @param {K} key @param {T} value */
    keep(key, value) {
      remove(key);
      known.set(key, value);
      size += sizeOf(value);
      for (const oldest of known.keys()) {
        if (size <= most || oldest === key) break;
        forget(oldest);
      }
      return value;
    },
    forget,
    get size() {
      return size;
    },
  };
}

/**
 * An entry: its pages, what its user counts in them, when it was last used (-1: it was evicted), and whether it is
 * kept longer than others.
 * @typedef {{ pages: Uint32Array, count: number, stamp: number, kept: boolean }} PoolEntry
 */

/**
 * A pool of equal pages of GPU memory; the least recently used entries are evicted when it is full. Stamps count views:
 * what was used at the current stamp is never evicted.
 *
 * @param {number} capacity @param {(key: number) => void} [onEvict]
 * @param {number} [ahead] pages that are made free besides those that are needed: to look for them takes long
 */
export function createPagePool(capacity, onEvict = () => {}, ahead = 0) {
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
    const old = [...entries].filter(([, entry]) => entry.stamp < stamp)
      .sort(([, a], [, b]) => Number(a.kept) - Number(b.kept) || a.stamp - b.stamp);
    for (const [key] of old) {
      if (left >= count + ahead) break;
      evict(key);
    }
    return left >= count;
  };
  return {
    /** An entry, marked as used, or undefined. @param {number} key @param {number} stamp */
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
     * @param {number} stamp @param {number} count @param {boolean} [kept]
     */
    allocate(key, many, stamp, count, kept = false) {
      if (left < many && !makeRoom(many, stamp)) return null;
      const entry = { pages: free.slice(left - many, left).reverse(), count, stamp, kept };
      left -= many;
      entries.set(key, entry);
      return entry;
    },
    /** Free pages. */
    get left() {
      return left;
    },
    get size() {
      return entries.size;
    },
    /** Evict all entries with such keys. @param {(key: number) => boolean} matches */
    evictWhere(matches) {
      for (const key of [...entries.keys()]) if (matches(key)) evict(key);
    },
  };
}
