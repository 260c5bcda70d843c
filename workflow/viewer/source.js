// Where a bundle's files come from: the page's own folder, or files that somebody dropped onto the page.

import { AGAIN } from "./manifest.js";

/** What went wrong, in words for the person at the screen: what happened, and what to do. */
export class PageError extends Error {}

const name = (file) => file.split("/").slice(-2).join("/");

/** Files beside the page. `read(file, size, {signal, onBytes})`: an ArrayBuffer of exactly that size (null: any). */
export function fromWeb(base) {
  return {
    async read(file, size, { signal, onBytes = () => {} } = {}) {
      const response = await get(new URL(file, base), file, signal);
      if (size === null) return response.arrayBuffer();
      const bytes = new Uint8Array(size), reader = response.body.getReader();
      let at = 0;
      for (;;) {
        let step;
        try {
          step = await reader.read();
        } catch (error) {
          throw signal?.aborted ? error : wrongSize(file, at, size); // the connection broke off
        }
        if (step.done) break;
        if (at + step.value.length > size) throw wrongSize(file, at + step.value.length, size);
        bytes.set(step.value, at);
        at += step.value.length;
        onBytes(step.value.length);
      }
      if (at < size) throw wrongSize(file, at, size);
      return bytes.buffer;
    },
  };
}

/** Dropped files: a map from their names to functions that give their bytes. */
export function fromFiles(files) {
  return {
    async read(file, size, { onBytes = () => {} } = {}) {
      const open = files.get(file);
      if (!open) {
        throw new PageError(`${name(file)} is not among the dropped files. Drop the whole folder, or its zip.`);
      }
      const buffer = await open();
      if (size !== null && buffer.byteLength !== size) throw wrongSize(file, buffer.byteLength, size);
      onBytes(buffer.byteLength);
      return buffer;
    },
  };
}

function wrongSize(file, came, size) {
  return new PageError(
    `${file} is ${came < size ? "cut short" : "too long"}: ${came} bytes came, ${size} were promised. `
    + `Reload the page. If that does not help: ${AGAIN}`);
}

async function get(url, file, signal) {
  let response;
  try {
    response = await fetch(url, { signal, cache: "no-cache" });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new PageError(`${name(file)} cannot be reached. Is “make view” still running?`);
  }
  if (!response.ok) {
    throw new PageError(`${name(file)} is not there (the server answered ${response.status}). ${AGAIN}`);
  }
  return response;
}
