// What a person paints and sets on the page, as plain values, as a JSON file and in a link (numbers of variable length,
// deflated, in base64url). Each is checked before it is used.
// Read by dav_gswt/terrain/class_rules.py too.

import { LATTICE, MAX_MATERIALS } from "../terrain/classes.js";
import { createPainted, findRunFault } from "../terrain/painted.js";
import { brief, isName, PageError } from "./checks.js";
import { MAX_CANDIDATES } from "./manifest.js";

/**
 * Runs of painted points; by object, how many times its measured density; by material, what is added to its bias.
 * @typedef {{ runs: import("../terrain/painted.js").Runs, densities: number[], offsets: number[] }} Paint
 * @typedef {import("./manifest.js").Manifest} Manifest
 */

export const MAX_DENSITY = 3, DENSITY_STEPS = 20; // densities are whole multiples of 1 / DENSITY_STEPS
export const MAX_OFFSET = 8, OFFSET_STEPS = 1000; // offsets are whole multiples of 1 / OFFSET_STEPS
export const MAX_FILE = 2 ** 24; // bytes
export const MAX_LINK = 6000; // characters: longer links are cut by some programs
const FORMAT = "davgswt-paint", VERSION = 1, LINK_VERSION = 1;
const MAX_UNPACKED = 2 ** 21; // bytes of what a link unpacks to

/** As the bundle was made. @param {Manifest} manifest @returns {Paint} */
export function blankPaint({ classes, materials, objects = [] }) {
  return { runs: classes?.painted ?? [], densities: objects.map(() => 1), offsets: materials.map(() => 0) };
}

/** The nearest multiple of 1 / steps within bounds. @param {number} v @param {number} steps @param {number[]} bounds */
export const snap = (v, steps, [low, high]) => Math.round(Math.min(Math.max(v, low), high) * steps) / steps;

/**
 * The content of the file: materials and objects by name, so that it outlives a change of their order.
 *
 * @param {Paint} paint @param {Manifest} manifest
 */
export function describePaint({ runs, densities, offsets }, { materials, objects = [] }) {
  return {
    format: FORMAT, version: VERSION, materials: materials.map(({ name }) => name), runs,
    densities: Object.fromEntries(objects.map(({ name }, k) => [name, densities[k]])),
    offsets: Object.fromEntries(materials.map(({ name }, m) => [name, offsets[m]])),
  };
}

/** Is this meant to be a file of paint? @param {any} value */
const isPaint = (value) => value?.format === FORMAT;

/**
 * What a file holds, for a terrain. Densities of objects that the terrain does not have are left out.
 * Throws a PageError: the file is none, contradicts itself, or is of other materials.
 *
 * @param {any} value parsed JSON
 * @param {Manifest} manifest
 * @returns {Paint}
 */
export function readPaint(value, { materials, objects = [] }) {
  if (!isPaint(value)) throw new PageError("The file holds no painted materials. Open one that “Save” has saved here.");
  if (value.version !== VERSION) {
    throw new PageError(`The painted materials have version ${brief(value.version)}, this page reads ${VERSION}.`);
  }
  const { materials: names, runs, densities = {}, offsets = {} } = value;
  if (!Array.isArray(names) || names.length > MAX_MATERIALS || !names.every(isName)) throw broken("materials");
  const fault = findRunFault(runs, names.length);
  if (fault) throw broken(fault);
  if (!areNumbers(densities, 0, MAX_DENSITY)) throw broken("densities");
  if (!areNumbers(offsets, -MAX_OFFSET, MAX_OFFSET)) throw broken("offsets");
  const numbers = names.map((/** @type {string} */ name) => materials.findIndex((one) => one.name === name));
  const used = new Set(runs.map((/** @type {number[]} */ run) => run[3]));
  const strange = names.find((/** @type {string} */ _, /** @type {number} */ m) => numbers[m] < 0 && used.has(m));
  if (strange !== undefined) {
    throw new PageError(`The file paints “${brief(strange)}”, and this terrain has no such material `
      + `(it has ${materials.map(({ name }) => name).join(", ")}).`);
  }
  return {
    runs: runs.map((/** @type {number[]} */ [i, j, length, m]) => [i, j, length, numbers[m]]),
    densities: objects.map(({ name }) => snap(own(densities, name, 1), DENSITY_STEPS, [0, MAX_DENSITY])),
    offsets: materials.map(({ name }) => snap(own(offsets, name, 0), OFFSET_STEPS, [-MAX_OFFSET, MAX_OFFSET])),
  };
}

/** @param {Record<string, number>} record @param {string} name @param {number} otherwise */
const own = (record, name, otherwise) => (Object.hasOwn(record, name) ? record[name] : otherwise);

/** @param {string} what */
const broken = (what) => new PageError(`The file of painted materials contradicts itself (“${what}”). Save it again.`);

/** Is this an object of numbers within bounds? @param {any} value @param {number} low @param {number} high */
const areNumbers = (value, low, high) => value !== null && typeof value === "object" && !Array.isArray(value)
  && Object.keys(value).length <= 1024 && Object.values(value).every((v) => Number.isFinite(v) && v >= low && v <= high);

/**
 * The changes of points that lead from what is painted to runs: I, J and material of each.
 *
 * @param {import("../terrain/painted.js").Painted} painted
 * @param {import("../terrain/painted.js").Runs} runs
 */
export function changesTo(painted, runs) {
  const wanted = createPainted(LATTICE), changes = [];
  for (const [i, j, length, m] of runs) for (let k = 0; k < length; k++) wanted.set(i + k, j, m);
  for (const [i, j] of painted.points()) if (wanted.get(i, j) < 0) changes.push([i, j, -1]);
  for (const [i, j, m] of wanted.points()) if (painted.get(i, j) !== m) changes.push([i, j, m]);
  return changes;
}

/**
 * Probabilities of objects that stand so many times as densely: those of one material sum to 1 at most, and no more
 * objects stand on a tile than the page draws.
 *
 * @param {Manifest} manifest
 * @param {number[]} densities by object
 */
export function scaleProbabilities({ objects = [], scatter, materials }, densities) {
  const scaled = objects.map(({ probability }, k) => probability * densities[k]);
  const sums = materials.map((_, m) => objects.reduce((sum, one, k) => sum + (one.material === m ? scaled[k] : 0), 0));
  const capped = scaled.map((p, k) => p / Math.max(1, sums[objects[k].material]));
  const crowd = ((scatter?.cells ?? 0) ** 2 * capped.reduce((sum, p) => sum + p, 0)) / MAX_CANDIDATES;
  return crowd > 1 ? capped.map((p) => p / crowd) : capped;
}

/** The text of a link. @param {Paint} paint @param {Manifest} manifest */
export async function encodePaint({ runs, densities, offsets }, manifest) {
  /** @type {number[]} */
  const bytes = [LINK_VERSION];
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
 * @param {string} text @param {Manifest} manifest
 * @returns {Promise<Paint>}
 */
export async function decodePaint(text, manifest) {
  const { materials, objects = [] } = manifest, bytes = await unpack(text);
  let at = 0;
  const take = () => {
    let n = 0;
    for (let scale = 1; ; scale *= 128) {
      if (at >= bytes.length || scale > 2 ** 49) throw cut();
      n += (bytes[at] % 128) * scale;
      if (bytes[at++] < 128) return n;
    }
  };
  const takeSigned = () => {
    const n = take();
    return n % 2 ? -(n + 1) / 2 : n / 2;
  };
  if (take() !== LINK_VERSION) throw cut();
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
  if (!sound) throw cut();
  return { densities, offsets, runs: sortRuns(runs) };
}

const cut = () => new PageError("The link's painted materials are cut short or changed; they are left out.");

/** Runs in their order, whatever that of a link is. @param {import("../terrain/painted.js").Runs} runs */
function sortRuns(runs) {
  const painted = createPainted(LATTICE);
  for (const [i, j, length, m] of runs) for (let k = 0; k < length; k++) painted.set(i + k, j, m);
  return painted.runs();
}

/** @param {string} text */
async function unpack(text) {
  if (!/^[\w-]*$/.test(text) || text.length > 2 * MAX_LINK) throw cut();
  try {
    const packed = atob(text.replaceAll("-", "+").replaceAll("_", "/"));
    const bytes = Uint8Array.from(packed, (c) => c.charCodeAt(0));
    return await pass(bytes, new DecompressionStream("deflate-raw"), MAX_UNPACKED);
  } catch {
    throw cut();
  }
}

/**
 * Bytes through a stream. Throws: more than `most` come out, or the stream refuses them.
 *
 * @param {Uint8Array<ArrayBuffer>} bytes @param {CompressionStream | DecompressionStream} stream
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
