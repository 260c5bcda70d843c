// An open terrain: its manifest and surface, the worker that chooses what is drawn, and the reading of its chunks. What
// the page and the importable terrain (terrain_api.js) have in common.

import { initialChunks, readChunks, readHeightMap, readManifest, readPictures } from "../data/bundle.js";
import { chunkKey, listChunks } from "../data/layout.js";
import { createHeights } from "../terrain/heights.js";
import { createWorkerClient } from "../worker/worker_client.js";

/**
 * What is read before anything is drawn.
 * @typedef {{ source: import("../data/source.js").Source, manifest: import("../data/manifest.js").Manifest,
 *   pixels: Float32Array | null, pictures: import("../terrain/classes.js").Pictures }} TerrainFiles
 *
 * @typedef {import("../worker/worker_client.js").Handlers} Handlers
 * @typedef {ReturnType<typeof openTerrain>} OpenTerrain
 */

/**
 * Read manifest, height map and pictures. Throws a PageError.
 *
 * @param {import("../data/source.js").Source} source
 * @returns {Promise<TerrainFiles>}
 */
export async function readTerrain(source) {
  const manifest = await readManifest(source), pixels = await readHeightMap(manifest, source);
  return { source, manifest, pixels, pictures: await readPictures(manifest, source) };
}

/**
 * Start the worker of a terrain.
 *
 * @param {TerrainFiles} files
 * @param {Handlers} handlers
 */
export function openTerrain({ source, manifest, pixels, pictures }, { onRecords, onFrame, onError }) {
  let whole = false; // everything was read that the cache holds
  /** @type {Set<number>} */
  const pending = new Set(); // keys of chunks that are being read again
  const stop = new AbortController();
  const client = createWorkerClient({ manifest, pixels, pictures }, {
    onRecords,
    onFrame(frame) {
      onFrame(frame);
      if (whole) readMissing(frame.missing);
    },
    onError,
  });
  /** @param {import("../data/bundle.js").Chunk} chunk */
  const take = (chunk) => client.add(chunk);

  /** Read chunks that were evicted from the cache, in a set larger than it. @param {number[]} missing */
  function readMissing(missing) {
    const keys = missing.filter((key) => !pending.has(key));
    if (!keys.length) return;
    for (const key of keys) pending.add(key);
    const queue = listChunks(manifest).filter(({ tile, entry }) => keys.includes(chunkKey(tile, entry.level)));
    readChunks(queue, source, { take, signal: stop.signal }).then(() => {
      for (const key of keys) pending.delete(key);
    }, (error) => { // and its chunks stay pending: they are not asked for in every frame
      if (!stop.signal.aborted) onError(error);
    });
  }

  return {
    source, manifest, client, pending, heights: createHeights(manifest.heights, pixels),
    /** Mean height of the ground of its tiles above the surface. */
    lift: mean(manifest.classes?.rise.ground ?? [0]),
    /**
     * Read the chunks, the coarsest level first. Returns: were they read, and not ended meanwhile? Throws a PageError.
     *
     * @param {(progress: import("../data/bundle.js").Progress) => void} [onProgress]
     */
    async readAll(onProgress) {
      try {
        await readChunks(initialChunks(manifest), source, { take, onProgress, signal: stop.signal });
      } catch (error) {
        if (stop.signal.aborted) return false;
        throw error;
      }
      whole = true;
      return true;
    },
    /** Stop the worker and all reading. */
    end() {
      stop.abort();
      client.end();
    },
  };
}

/** @param {number[]} values */
const mean = (values) => values.reduce((sum, v) => sum + v, 0) / values.length;
