// Reading a bundle: where it comes from, then davgswt.json, its height map and its parts in the manifest's order, each
// once, and checked before it is used.

import { isCoordinate, PageError, REMAKE } from "./checks.js";
import { gswtSource, isGswt } from "./gswt.js";
import { findFault, KINDS, NAME, pickKnown } from "./manifest.js";
import { fileSource, openZip, readStream, webSource } from "./source.js";

/**
 * @typedef {import("./manifest.js").Manifest} Manifest
 * @typedef {import("./manifest.js").PartEntry} PartEntry
 * @typedef {import("./source.js").Source} Source
 * @typedef {import("./source.js").Files} Files
 *
 * Bytes and parts so far, of all.
 * @typedef {{ bytes: number, total: number, parts: number, of: number }} Progress
 */

const PARALLEL = 3; // requests at a time

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

/** The parts of a bundle that this page reads, in order. @param {Manifest} manifest */
export const listParts = ({ parts }) =>
  parts.map((part, index) => ({ part, index })).filter(({ part }) => KINDS.has(part.kind));

/** Bytes to read. @param {Manifest} manifest */
export const sizeOf = (manifest) => listParts(manifest).reduce((sum, { part }) => sum + part.bytes, 0);

/**
 * Read all parts, and hand the number and the unpacked bytes of each to `take` as it arrives; waits for what that
 * returns. The first failure stops all other requests and is thrown.
 *
 * @param {Manifest} manifest @param {Source} source
 * @param {{ take: (index: number, buffer: ArrayBuffer) => void | Promise<void>,
 *   onProgress?: (progress: Progress) => void, signal?: AbortSignal }} options
 */
export async function readParts(manifest, source, { take, onProgress = () => {}, signal }) {
  const queue = listParts(manifest), progress = { bytes: 0, total: sizeOf(manifest), parts: 0, of: queue.length };
  const stop = new AbortController();
  signal?.addEventListener("abort", () => stop.abort(signal.reason), { once: true });
  /** @type {unknown} */
  let first = null;
  let next = 0;
  /** @param {unknown} error */
  const fail = (error) => {
    first ??= error;
    stop.abort();
  };
  /** @type {(void | Promise<void>)[]} */
  const taken = [];
  /** @param {number} bytes */
  const onBytes = (bytes) => {
    progress.bytes += bytes;
    onProgress(progress);
  };
  const readNext = async () => {
    while (next < queue.length && !stop.signal.aborted) {
      const { part, index } = queue[next++], read = await readChecked(source, part, { signal: stop.signal, onBytes });
      const buffer = part.kind === "plain" ? read : await inflate(read, part);
      stop.signal.throwIfAborted();
      taken.push(Promise.resolve(take(index, buffer)).catch(fail));
      progress.parts += 1;
      onProgress(progress);
    }
  };
  await Promise.all(Array.from({ length: PARALLEL }, () => readNext().catch(fail)));
  await Promise.all(taken);
  if (first) throw first;
}

/** @param {ArrayBuffer} packed @param {PartEntry} part */
async function inflate(packed, { file, size }) {
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  /** @param {string} what */
  const broken = (what) => new PageError(`${file} is ${what} where it is unpacked. ${REMAKE}`);
  return (await readStream(stream, size, broken)).buffer;
}

/**
 * The bytes of a file, asked for again where that may help.
 *
 * @param {Source} source @param {{ file: string, bytes: number, sha256?: string }} entry
 * @param {import("./source.js").ReadOptions} [options]
 */
async function readChecked(source, entry, { signal, onBytes = () => {} } = {}) {
  let came = 0;
  /** @param {number} bytes */
  const count = (bytes) => {
    came += bytes;
    onBytes(bytes);
  };
  for (const pause of source.pauses ?? []) {
    try {
      return await readOnce(source, entry, { signal, onBytes: count });
    } catch (error) {
      if (signal?.aborted) throw error;
    }
    count(-came);
    await new Promise((done) => setTimeout(done, pause));
  }
  return readOnce(source, entry, { signal, onBytes });
}

/**
 * The bytes of a file, compared with the manifest's SHA-256 where the browser offers it (https, or this machine's own
 * address).
 *
 * @param {Source} source @param {{ file: string, bytes: number, sha256?: string }} entry
 * @param {import("./source.js").ReadOptions} [options]
 */
async function readOnce(source, { file, bytes, sha256 }, options) {
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
