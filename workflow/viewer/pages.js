// Room on the GPU in pages of equal size, given out and taken back; what has not been used for longest goes first.

/** `take(key, count, stamp)`: pages for an entry, or null; `use(key, stamp)`: its pages, or undefined. */
export function createPages(capacity, onEvict = () => {}) {
  const free = Uint32Array.from({ length: capacity }, (_, k) => capacity - 1 - k);
  const entries = new Map();
  let left = capacity;
  const drop = (key) => {
    for (const page of entries.get(key).pages) free[left++] = page;
    entries.delete(key);
    onEvict(key);
  };
  /** Make room for `count` pages without touching what was used at `stamp`. */
  const makeRoom = (count, stamp) => {
    const old = [...entries].filter(([, entry]) => entry.stamp < stamp).sort((a, b) => a[1].stamp - b[1].stamp);
    for (const [key] of old) {
      if (left >= count) break;
      drop(key);
    }
    return left >= count;
  };
  return {
    use(key, stamp) {
      const entry = entries.get(key);
      if (!entry) return undefined;
      entry.stamp = stamp;
      return entry.pages;
    },
    take(key, count, stamp) {
      if (left < count && !makeRoom(count, stamp)) return null;
      const pages = free.slice(left - count, left).reverse();
      left -= count;
      entries.set(key, { pages, stamp });
      return pages;
    },
    has: (key) => entries.has(key),
    /** Drop all entries that `which` names. */
    dropWhere(which) {
      for (const key of [...entries.keys()]) if (which(key)) drop(key);
    },
    get used() {
      return capacity - left;
    },
  };
}
