// Sources of a bundle's files: the page's own folder, or files that were dropped onto the page. Nothing is allocated
// for a file before its size is compared with the one that is expected.

import { PageError, REMAKE } from "./checks.js";

/**
 * `read(file, size, options)` gives exactly `size` bytes (null: at most MAX_BYTES), or throws a PageError.
 *
 * @typedef {{ signal?: AbortSignal, onBytes?: (bytes: number) => void }} ReadOptions
 * @typedef {{ read: (file: string, size: number | null, options?: ReadOptions) => Promise<ArrayBuffer> }} Source
 *
 * Files by name: their size, and how they are read.
 * @typedef {{ size: number, open: () => Promise<ArrayBuffer> }} FileEntry
 * @typedef {Map<string, FileEntry>} Files
 */

export const MAX_BYTES = 2 ** 26; // of a file whose size nothing says, such as a manifest
export const MAX_FILES = 4096; // in a folder or a zip

/** @param {string} file */
const shortName = (file) => file.split("/").slice(-2).join("/");

/**
 * Files below a URL.
 *
 * @param {URL} base
 * @returns {Source}
 */
export function webSource(base) {
  return {
    async read(file, size, { signal, onBytes = () => {} } = {}) {
      const response = await request(new URL(file, base), file, signal);
      if (size === null) return readAll(response, file, signal);
      const bytes = new Uint8Array(size);
      let at = 0;
      for await (const part of partsOf(response, signal, () => wrongSize(file, at, size))) {
        if (at + part.length > size) throw wrongSize(file, at + part.length, size);
        bytes.set(part, at);
        at += part.length;
        onBytes(part.length);
      }
      if (at < size) throw wrongSize(file, at, size);
      return bytes.buffer;
    },
  };
}

/**
 * All bytes of a response.
 *
 * @param {Response} response
 * @param {string} file
 * @param {AbortSignal | undefined} signal
 */
async function readAll(response, file, signal) {
  const parts = [];
  let at = 0;
  for await (const part of partsOf(response, signal, () => wrongSize(file, at, at + 1))) {
    at += part.length;
    if (at > MAX_BYTES) throw tooLarge(file);
    parts.push(/** @type {Uint8Array<ArrayBuffer>} */ (part));
  }
  return new Blob(parts).arrayBuffer();
}

/**
 * The parts of a response as they arrive. broken: gives the error for a connection that breaks off.
 *
 * @param {Response} response
 * @param {AbortSignal | undefined} signal
 * @param {() => Error} broken
 */
async function* partsOf(response, signal, broken) {
  const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader();
  for (;;) {
    let step;
    try {
      step = await reader.read();
    } catch (error) {
      throw signal?.aborted ? error : broken();
    }
    if (step.done) return;
    yield step.value;
  }
}

/**
 * Dropped files.
 *
 * @param {Files} files
 * @returns {Source}
 */
export function fileSource(files) {
  return {
    async read(file, size, { onBytes = () => {} } = {}) {
      const entry = files.get(file);
      if (!entry) {
        throw new PageError(`${shortName(file)} is not among the dropped files. Drop the whole folder, or its zip.`);
      }
      if (size === null && entry.size > MAX_BYTES) throw tooLarge(file);
      if (size !== null && entry.size !== size) throw wrongSize(file, entry.size, size);
      const buffer = await entry.open();
      if (size !== null && buffer.byteLength !== size) throw wrongSize(file, buffer.byteLength, size);
      onBytes(buffer.byteLength);
      return buffer;
    },
  };
}

/** @param {string} file */
export const tooLarge = (file) => new PageError(`${shortName(file)} is too large for what it is. ${REMAKE}`);

/** @param {string} file @param {number} came @param {number} size */
function wrongSize(file, came, size) {
  return new PageError(
    `${file} is ${came < size ? "cut short" : "too long"}: ${came} bytes came, ${size} were promised. `
    + `Reload the page. If that does not help: ${REMAKE}`);
}

/** @param {URL} url @param {string} file @param {AbortSignal} [signal] */
async function request(url, file, signal) {
  let response;
  try {
    response = await fetch(url, { signal, cache: "no-cache" });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new PageError(`${shortName(file)} cannot be reached. Is “make view” still running?`);
  }
  if (!response.ok) {
    throw new PageError(`${shortName(file)} is not there (the server answered ${response.status}). ${REMAKE}`);
  }
  return response;
}
