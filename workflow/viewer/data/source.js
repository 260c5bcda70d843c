// Sources of a bundle's files: the page's own folder, or files that were dropped onto the page. No more of a file is
// read than the size that is expected.

import { PageError, REMAKE } from "./checks.js";

/**
 * `read(file, size, options)` gives exactly `size` bytes (null: at most MAX_BYTES), or throws a PageError. pauses:
 * milliseconds before it is worth another try.
 *
 * @typedef {{ signal?: AbortSignal, onBytes?: (bytes: number) => void }} ReadOptions
 * @typedef {{ read: (file: string, size: number | null, options?: ReadOptions) => Promise<ArrayBuffer>,
 *   pauses?: number[] }} Source
 *
 * Files by name: their size, and how they are read.
 * @typedef {{ size: number, open: () => Promise<ArrayBuffer> }} FileEntry
 * @typedef {Map<string, FileEntry>} Files
 */

export const MAX_BYTES = 2 ** 26; // of a file whose size nothing says, such as a manifest
export const MAX_FILES = 4096; // in a folder or a zip
const PAUSES = [300, 900, 2700]; // milliseconds

/** @param {string} file */
const shortName = (file) => file.split("/").slice(-2).join("/");

/** Files below a URL. @param {URL} base @returns {Source} */
export function webSource(base) {
  return {
    pauses: PAUSES,
    async read(file, size, { signal, onBytes = () => {} } = {}) {
      const response = await request(new URL(file, base), file, signal), most = size ?? MAX_BYTES;
      const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader(), parts = [];
      let came = 0;
      for (;;) {
        const { done, value } = await reader.read().catch((error) => {
          throw signal?.aborted ? error : wrongSize(file, came, size ?? came + 1);
        });
        if (done) break;
        came += value.length;
        if (came > most) throw size === null ? tooLarge(file) : wrongSize(file, came, size);
        parts.push(value);
        onBytes(value.length);
      }
      if (size !== null && came < size) throw wrongSize(file, came, size);
      const bytes = new Uint8Array(came);
      for (const part of parts.reverse()) {
        came -= part.length;
        bytes.set(part, came);
      }
      return bytes.buffer;
    },
  };
}

/** Dropped files. @param {Files} files @returns {Source} */
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

/**
 * The bytes of a stream, which are exactly `size`: it is stopped at the first one more.
 *
 * @param {ReadableStream<Uint8Array>} stream @param {number} size
 * @param {(what: string) => PageError} broken
 */
export async function readStream(stream, size, broken) {
  const bytes = new Uint8Array(size), reader = stream.getReader();
  let at = 0;
  try {
    for (let step = await reader.read(); !step.done; step = await reader.read()) {
      if (at + step.value.length > size) {
        await reader.cancel();
        throw broken("larger than was promised");
      }
      bytes.set(step.value, at);
      at += step.value.length;
    }
  } catch (error) {
    throw error instanceof PageError ? error : broken("damaged");
  }
  if (at < size) throw broken("cut short");
  return bytes;
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
