// Sources of a bundle's files: the page's own folder, or files that were dropped onto the page.

import { PageError, REMAKE } from "./errors.js";

/**
 * `read(file, size, options)` gives exactly `size` bytes (null: any number), or throws a PageError.
 *
 * @typedef {{ signal?: AbortSignal, onBytes?: (bytes: number) => void }} ReadOptions
 * @typedef {{ read: (file: string, size: number | null, options?: ReadOptions) => Promise<ArrayBuffer> }} Source
 * @typedef {Map<string, () => Promise<ArrayBuffer>>} Files functions that read files, by name
 */

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
      if (size === null) return response.arrayBuffer();
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
      const open = files.get(file);
      if (!open) {
        throw new PageError(`${shortName(file)} is not among the dropped files. Drop the whole folder, or its zip.`);
      }
      const buffer = await open();
      if (size !== null && buffer.byteLength !== size) throw wrongSize(file, buffer.byteLength, size);
      onBytes(buffer.byteLength);
      return buffer;
    },
  };
}

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
