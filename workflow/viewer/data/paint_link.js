// Painted materials in a link: numbers of variable length, deflated, in base64url.

import { LATTICE } from "../terrain/classes.js";
import { createPainted, findRunFault } from "../terrain/painted.js";
import { PageError } from "./errors.js";
import { DENSITY_STEPS, MAX_DENSITY, MAX_OFFSET, OFFSET_STEPS } from "./paint.js";

/** @typedef {import("./paint.js").Paint} Paint */
/** @typedef {import("./manifest.js").Manifest} Manifest */

export const MAX_LINK = 6000; // characters: longer links are cut by some programs
const VERSION = 1, MAX_BYTES = 2 ** 21; // of what a link unpacks to

/**
 * @param {Paint} paint
 * @param {Manifest} manifest
 */
export async function encodePaint({ runs, densities, offsets }, manifest) {
  /** @type {number[]} */
  const bytes = [VERSION];
  /** @param {number} n */
  const put = (n) => {
    for (; n >= 128; n = Math.floor(n / 128)) bytes.push((n % 128) + 128);
    bytes.push(n);
  };
  /** Small numbers of either sign. @param {number} n */
  const putSigned = (n) => put(n < 0 ? -2 * n - 1 : 2 * n);
  put(namesOf(manifest));
  for (const density of densities) put(Math.round(density * DENSITY_STEPS));
  for (const offset of offsets) putSigned(Math.round(offset * OFFSET_STEPS));
  let east = 0, north = 0;
  for (const [i, j, length, material] of runs) { // each from the start of the one before
    for (const n of [j - north, i - east]) putSigned(n);
    for (const n of [length, material]) put(n);
    [east, north] = [i, j];
  }
  const packed = await pass(Uint8Array.from(bytes), new CompressionStream("deflate-raw"), Infinity);
  let text = "";
  for (const byte of packed) text += String.fromCharCode(byte);
  return btoa(text).replaceAll("+", "-").replaceAll("/", "_").replace(/=+$/, "");
}

/**
 * What a link holds. Throws a PageError: it is cut or changed, or of another terrain.
 *
 * @param {string} text
 * @param {Manifest} manifest
 * @returns {Promise<Paint>}
 */
export async function decodePaint(text, manifest) {
  const { materials, objects = [] } = manifest, bytes = await unpack(text);
  let at = 0;
  const take = () => {
    let n = 0;
    for (let scale = 1; ; scale *= 128) {
      if (at >= bytes.length || scale > 2 ** 49) throw broken();
      n += (bytes[at] % 128) * scale;
      if (bytes[at++] < 128) return n;
    }
  };
  const takeSigned = () => {
    const n = take();
    return n % 2 ? -(n + 1) / 2 : n / 2;
  };
  if (take() !== VERSION) throw broken();
  if (take() !== namesOf(manifest)) {
    throw new PageError("The link's painted materials are of another terrain; they are left out.");
  }
  const densities = objects.map(() => take() / DENSITY_STEPS);
  const offsets = materials.map(() => takeSigned() / OFFSET_STEPS);
  const runs = [];
  for (let i = 0, j = 0; at < bytes.length;) {
    j += takeSigned();
    i += takeSigned();
    runs.push([i, j, take(), take()]);
  }
  const sound = densities.every((v) => v <= MAX_DENSITY) && offsets.every((v) => Math.abs(v) <= MAX_OFFSET)
    && !findRunFault(runs, materials.length);
  if (!sound) throw broken();
  return { densities, offsets, runs: sortRuns(runs) };
}

const broken = () => new PageError("The link's painted materials are cut short or changed; they are left out.");

/** Runs in their order, whatever that of a link is. @param {import("../terrain/painted.js").Runs} runs */
function sortRuns(runs) {
  const painted = createPainted(LATTICE);
  for (const [i, j, length, m] of runs) for (let k = 0; k < length; k++) painted.set(i + k, j, m);
  return painted.runs();
}

/** @param {string} text */
async function unpack(text) {
  if (!/^[\w-]*$/.test(text) || text.length > 2 * MAX_LINK) throw broken();
  try {
    const packed = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    return await pass(Uint8Array.from(packed, (c) => c.charCodeAt(0)), new DecompressionStream("deflate-raw"), MAX_BYTES);
  } catch {
    throw broken();
  }
}

/**
 * Bytes through a stream. Throws: more than `most` come out, or the stream refuses them.
 *
 * @param {Uint8Array<ArrayBuffer>} bytes
 * @param {CompressionStream | DecompressionStream} stream
 * @param {number} most
 */
async function pass(bytes, stream, most) {
  const reader = new Blob([bytes]).stream().pipeThrough(stream).getReader(), parts = [];
  for (let sum = 0; ;) {
    const { done, value } = await reader.read();
    if (done) break;
    sum += value.length;
    if (sum > most) throw new RangeError("too long");
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

/** 32 bits of the names of materials and objects (FNV-1a). @param {Manifest} manifest */
function namesOf({ materials, objects = [] }) {
  let hash = 0x811c9dc5;
  for (const byte of new TextEncoder().encode(JSON.stringify([materials, objects].map((all) => all.map((o) => o.name))))) {
    hash = Math.imul(hash ^ byte, 0x01000193);
  }
  return hash >>> 0;
}
