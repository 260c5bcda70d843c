// The bundle: davgswt.json, its surface and its chunks, read coarse level first, each checked before it is used.

import { AGAIN, faultOf } from "./manifest.js";
import { PageError } from "./source.js";
import { BOUND } from "./store.js";

const AT_ONCE = 6; // requests under way
export const NAME = "davgswt.json";

/** Read and check the manifest. Raises: PageError. */
export async function readManifest(source) {
  const text = new TextDecoder().decode(await source.read(NAME, null));
  let manifest;
  try {
    manifest = JSON.parse(text);
  } catch (error) {
    throw new PageError(`${NAME} is not readable as JSON (${error.message}). ${AGAIN}`);
  }
  const fault = faultOf(manifest);
  if (fault) throw new PageError(`${NAME}: ${fault}`);
  return manifest;
}

/** The pixels of the surface, or null where it has none. Raises: PageError. */
export async function readHeights({ heights }, source) {
  if (heights?.kind !== "image") return null;
  const buffer = await source.read(heights.file, heights.bytes);
  await checkDigest(buffer, heights);
  const pixels = new Float32Array(buffer);
  if (!pixels.every(Number.isFinite)) throw new PageError(`${heights.file}: a height is not finite. ${AGAIN}`);
  return pixels;
}

/** What to read at first, the coarsest level first: all chunks, or as many as are kept at a time. */
export function firstChunks(manifest) {
  const queue = manifest.tiles.flatMap((tile) => tile.chunks.map((entry) => ({ tile: tile.tile, entry })));
  queue.sort((a, b) => b.entry.level - a.entry.level || a.tile - b.tile);
  let sum = 0;
  return queue.filter(({ entry }) => (sum += entry.bytes) <= BOUND);
}

/**
 * Read chunks and hand each to `take` as it arrives.
 *
 * onProgress({bytes, total, chunks, of}) follows the bytes. The first failure stops all other requests and is thrown.
 */
export async function readChunks(queue, source, { take, onProgress = () => {}, signal }) {
  const total = queue.reduce((sum, { entry }) => sum + entry.bytes, 0);
  const progress = { bytes: 0, total, chunks: 0, of: queue.length };
  const stop = new AbortController();
  signal?.addEventListener("abort", () => stop.abort(signal.reason), { once: true });
  let next = 0;
  const worker = async () => {
    while (next < queue.length) {
      const { tile, entry } = queue[next++];
      const onBytes = (bytes) => {
        progress.bytes += bytes;
        onProgress(progress);
      };
      const buffer = await source.read(entry.file, entry.bytes, { signal: stop.signal, onBytes });
      await checkDigest(buffer, entry);
      stop.signal.throwIfAborted();
      take({ tile, level: entry.level, count: entry.count, buffer });
      progress.chunks += 1;
      onProgress(progress);
    }
  };
  let first = null;
  const guarded = () => worker().catch((error) => {
    first ??= error;
    stop.abort();
  });
  await Promise.all(Array.from({ length: AT_ONCE }, guarded));
  if (first) throw first;
}

/** Compare with the manifest's SHA-256 where the browser offers it (https, or this machine's own address). */
async function checkDigest(buffer, { file, sha256 }) {
  if (!globalThis.crypto?.subtle || typeof sha256 !== "string") return;
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", buffer));
  const text = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  if (text !== sha256.toLowerCase()) {
    throw new PageError(
      `${file} is damaged (its SHA-256 is not the manifest's). Reload the page. If that does not help: ${AGAIN}`);
  }
}
