// Reading a bundle: where it comes from, then davgswt.json, its height map and its chunks, coarse levels first, each
// checked before it is used.

import { isCoordinate, PageError, REMAKE } from "./checks.js";
import { gswtSource, isGswt } from "./gswt.js";
import { indexType, listChunks, RECORD, viewRoom } from "./layout.js";
import { findFault, NAME, pickKnown } from "./manifest.js";
import { fileSource, webSource } from "./source.js";
import { openZip } from "./zip.js";

/**
 * @typedef {import("./manifest.js").Manifest} Manifest
 * @typedef {import("./manifest.js").ChunkEntry} ChunkEntry
 * @typedef {import("./source.js").Source} Source
 * @typedef {import("./source.js").Files} Files
 *
 * A chunk to read, and a chunk that was read.
 * @typedef {{ tile: number, entry: ChunkEntry }} QueueItem
 * @typedef {{ tile: number, level: number, count: number, buffer: ArrayBuffer }} Chunk
 *
 * Bytes and chunks so far, of all.
 * @typedef {{ bytes: number, total: number, chunks: number, of: number }} Progress
 */

const PARALLEL = 6; // requests at a time

/**
 * The source of a terrain: the address of its folder, the folder's files (paths as a directory picker gives them), or
 * its zip. Throws a PageError.
 *
 * @param {string | URL | Blob | Iterable<File>} where
 * @returns {Promise<Source>}
 */
export async function openSource(where) {
  if (typeof where === "string" || where instanceof URL) return webSource(folderOf(where));
  if (where instanceof Blob) return sourceOf(await openZip(where));
  return sourceOf(filesOf(new Map([...where].map((file) => [file.webkitRelativePath || file.name, file]))));
}

/** The address of a folder or of the manifest in it, against the page's own. @param {string | URL} where */
function folderOf(where) {
  const address = new URL(where, globalThis.document?.baseURI ?? globalThis.location?.href);
  if (!address.pathname.endsWith("/") && !address.pathname.endsWith(`/${NAME}`)) address.pathname += "/";
  return new URL(".", address);
}

/** @param {Map<string, Blob>} files @returns {Files} */
export const filesOf = (files) =>
  new Map([...files].map(([name, file]) => [name, { size: file.size, open: () => file.arrayBuffer() }]));

/**
 * A bundle, wherever its manifest lies among the files, or a set of tiles for the public renderer.
 *
 * @param {Files} files
 * @returns {Promise<Source>}
 */
export async function sourceOf(files) {
  const manifest = [...files.keys()].filter((name) => name === NAME || name.endsWith(`/${NAME}`))
    .sort((a, b) => a.length - b.length)[0];
  if (manifest !== undefined) {
    const above = manifest.slice(0, -NAME.length);
    const inside = [...files].filter(([name]) => name.startsWith(above));
    return fileSource(new Map(inside.map(([name, entry]) => [name.slice(above.length), entry])));
  }
  if (isGswt(files)) return gswtSource(files);
  throw new PageError(
    `There is no terrain in what was dropped: neither ${NAME} nor lod0_tile_00.ply. `
    + "Drop a bundle's folder or its gswt.zip.");
}

/** The checked manifest. Throws a PageError. @param {Source} source @returns {Promise<Manifest>} */
export async function readManifest(source) {
  const text = new TextDecoder().decode(await source.read(NAME, null));
  let manifest;
  try {
    manifest = JSON.parse(text);
  } catch (error) {
    throw new PageError(`${NAME} is not readable as JSON (${/** @type {Error} */ (error).message}). ${REMAKE}`);
  }
  const fault = findFault(manifest);
  if (fault) throw new PageError(`${NAME}: ${fault}`);
  return pickKnown(manifest);
}

/**
 * The pixels of the height map, or null where there is none. Throws a PageError.
 *
 * @param {Manifest} manifest @param {Source} source
 */
export async function readHeightMap({ heights }, source) {
  if (heights?.kind !== "image") return null;
  const pixels = new Float32Array(await readChecked(source, heights));
  if (!pixels.every(isCoordinate)) {
    throw new PageError(`${heights.file}: a height is not finite, or beyond all bounds. ${REMAKE}`);
  }
  return pixels;
}

/**
 * The chunks to read first, the coarsest level first: all, or the coarsest level alone if the set does not fit into the
 * cache. The worker then asks for what a view needs.
 *
 * @param {Manifest} manifest
 * @returns {QueueItem[]}
 */
export function initialChunks(manifest) {
  const queue = listChunks(manifest);
  queue.sort((a, b) => b.entry.level - a.entry.level || a.tile - b.tile);
  return viewRoom(manifest) ? queue.filter(({ entry }) => entry.level === manifest.levels.length - 1) : queue;
}

/**
 * Read chunks and hand each to `take` as it arrives. The first failure stops all other requests and is thrown.
 *
 * @param {QueueItem[]} queue @param {Source} source
 * @param {{ take: (chunk: Chunk) => void, onProgress?: (progress: Progress) => void, signal?: AbortSignal }} options
 */
export async function readChunks(queue, source, { take, onProgress = () => {}, signal }) {
  const total = queue.reduce((sum, { entry }) => sum + entry.bytes, 0);
  const progress = { bytes: 0, total, chunks: 0, of: queue.length };
  const stop = new AbortController();
  signal?.addEventListener("abort", () => stop.abort(signal.reason), { once: true });
  let next = 0;
  /** @param {number} bytes */
  const onBytes = (bytes) => {
    progress.bytes += bytes;
    onProgress(progress);
  };
  const readNext = async () => {
    while (next < queue.length) {
      const { tile, entry } = queue[next++];
      const buffer = await readChecked(source, entry, { signal: stop.signal, onBytes });
      checkOrders(buffer, entry);
      stop.signal.throwIfAborted();
      take({ tile, level: entry.level, count: entry.count, buffer });
      progress.chunks += 1;
      onProgress(progress);
    }
  };
  /** @type {unknown} */
  let first = null;
  const guarded = () => readNext().catch((error) => {
    first ??= error;
    stop.abort();
  });
  await Promise.all(Array.from({ length: PARALLEL }, guarded));
  if (first) throw first;
}

/**
 * Every order must hold each Gaussian once: entries beyond the chunk would draw what is not there.
 *
 * @param {ArrayBuffer} buffer @param {ChunkEntry} entry
 */
function checkOrders(buffer, { file, count, orders }) {
  const indices = new (indexType(count))(buffer, count * RECORD), seen = new Uint8Array(count);
  for (let d = 1, at = 0; d <= orders.length; d++) {
    for (let k = 0; k < count; k++, at++) {
      const index = indices[at];
      if (index >= count || seen[index] === d) {
        throw new PageError(`${file}: an order does not hold every splat once. ${REMAKE}`);
      }
      seen[index] = d;
    }
  }
}

/**
 * The bytes of a file, compared with the manifest's SHA-256 where the browser offers it (https, or this machine's own
 * address).
 *
 * @param {Source} source @param {{ file: string, bytes: number, sha256?: string }} entry
 * @param {import("./source.js").ReadOptions} [options]
 */
async function readChecked(source, { file, bytes, sha256 }, options) {
  const buffer = await source.read(file, bytes, options);
  if (!globalThis.crypto?.subtle || sha256 === undefined) return buffer;
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", buffer));
  const text = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  if (text !== sha256.toLowerCase()) {
    throw new PageError(
      `${file} is damaged (its SHA-256 is not the manifest's). Reload the page. If that does not help: ${REMAKE}`);
  }
  return buffer;
}
