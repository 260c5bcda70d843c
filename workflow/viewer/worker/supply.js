// Where chunks come from: parts are unpacked, and chunks composed of them when a view needs them, the nearest first.

import { createComposer, parseRecords } from "../data/compose.js";
import { chunkKey } from "../data/layout.js";
import { run } from "../terrain/steps.js";

/**
 * onChunk: a chunk is at hand; onPart: a part was unpacked.
 * @typedef {{ onChunk?: (chunk: import("./chunk_store.js").StoredChunk) => void,
 *   onPart?: (index: number) => void }} Handlers
 */

/**
 * @param {import("../data/manifest.js").Manifest} manifest @param {import("./terrain_tables.js").TerrainTables} terrain
 * @param {import("./chunk_store.js").ChunkStore} store @param {Handlers} handlers
 */
export function createSupply(manifest, terrain, store, { onChunk = () => {}, onPart = () => {} }) {
  const composer = createComposer(manifest);
  /** @type {Generator<void, unknown>[]} */
  const jobs = []; // parts that came, and a chunk
  // keys of chunks: of the coarsest level, of what the last view lacks, and of what may be needed next
  /** @type {number[][]} */
  let lists = [terrain.tiles.map((_, tile) => chunkKey(tile, terrain.levels - 1)), [], []];
  let stamp = 0, composed = 0;

  /** Unpack a part. @param {number} index @param {ArrayBuffer} buffer */
  function* unpack(index, buffer) {
    yield* composer.add(index, buffer);
    onPart(index);
  }

  /** @param {number} key */
  const isLacking = (key) => !((terrain.tiles[key >> 4].arrived >> (key & 15)) & 1);
  /** @param {number} key */
  const isReady = (key) => isLacking(key) && composer.has(key >> 4, key & 15);
  /** @param {number} key */
  const fits = (key) => isReady(key) && store.hasRoom(terrain.tiles[key >> 4].counts[key & 15]);

  /** Compose a chunk and keep it. Returns: was there room for it? @param {number} key */
  function* bring(key) {
    const tile = key >> 4, level = key & 15;
    lists = lists.map((keys) => keys.filter((other) => other !== key));
    const parsed = yield* parseRecords(yield* composer.compose(tile, level), manifest.encoding);
    const count = parsed.sizes.length;
    composed += count;
    if (!isLacking(key) || !store.add({ tile, level, count, ...parsed }, stamp)) return false;
    onChunk(store.get(tile, level));
    return true;
  }

  /** Take all steps that are under way. */
  const finish = () => {
    for (const job of jobs.splice(0)) run(job);
  };
  /** @param {number[]} keys @returns {boolean} is there more at hand than before? */
  const bringAll = (keys) => keys.filter(isReady).map((key) => run(bring(key))).includes(true);

  return {
    finish,
    /** A view begins: it has at least the coarsest level everywhere. @param {number} now its stamp */
    begin(now) {
      stamp = now;
      bringAll(lists[0]);
      while (lists[0].length && jobs.length) {
        run(jobs[0]);
        jobs.shift();
        bringAll(lists[0]);
      }
    },
    /** Take a part, to be unpacked step by step. @param {number} index @param {ArrayBuffer} buffer */
    addPart: (index, buffer) => void jobs.push(unpack(index, buffer)),
    /** List what a view lacks, the nearest first. @param {import("../terrain/budget.js").Selection} selection */
    want({ cells, missing }) {
      /** @type {Set<number>} */
      const keys = new Set();
      for (let k = cells.length - 1; missing.size && k >= 0; k--) {
        for (const tile of [...cells[k].tiles, ...cells[k].things.map((thing) => thing.tile)]) {
          for (let level = 0; level < terrain.levels; level++) {
            if (missing.has(chunkKey(tile, level))) keys.add(chunkKey(tile, level));
          }
        }
      }
      lists = [lists[0], [...keys, ...missing], []];
    },
    /** List what may be needed next: it is composed if there is room for it. @param {number[]} keys */
    prepare(keys) {
      lists[2] = keys;
    },
    /** Compose what the view lacks. Returns: is there more at hand than before? */
    bringWanted: () => bringAll(lists[1]),
    /** A step of unpacking or composing. Returns: was there one? */
    advance() {
      const key = jobs.length ? 0 : lists[0].find(isReady) ?? lists[1].find(isReady) ?? lists[2].find(fits);
      if (key === undefined) return false;
      if (!jobs.length) jobs.push(bring(key));
      const [job] = jobs;
      let over = true; // as it is after an error
      try {
        over = job.next().done === true;
      } finally {
        if (over) jobs.shift();
      }
      return true;
    },
    /** Records of a chunk, kept or not, whose parts were unpacked. @param {number} tile @param {number} level */
    recordsOf: (tile, level) => run(composer.compose(tile, level)),
    /** Gaussians so far. */
    get composed() {
      return composed;
    },
  };
}
