// What a person paints and sets on the page, as plain values and as a JSON file. Each is checked before it is used.
// Read by dav_gswt/terrain/paint_file.py too.

import { LATTICE, MAX_MATERIALS } from "../terrain/classes.js";
import { createPainted, findRunFault } from "../terrain/painted.js";
import { brief, isName } from "./checks.js";
import { PageError } from "./errors.js";
import { MAX_CANDIDATES } from "./land_cover.js";

/**
 * Runs of painted points; by object, how many times its measured density; by material, what is added to its bias.
 * @typedef {{ runs: import("../terrain/painted.js").Runs, densities: number[], offsets: number[] }} Paint
 * @typedef {import("./manifest.js").Manifest} Manifest
 */

export const MAX_DENSITY = 3, DENSITY_STEPS = 20; // densities are whole multiples of 1 / DENSITY_STEPS
export const MAX_OFFSET = 8, OFFSET_STEPS = 1000; // offsets are whole multiples of 1 / OFFSET_STEPS
export const MAX_FILE = 2 ** 24; // bytes
const FORMAT = "davgswt-paint", VERSION = 1;

/** As the bundle was made. @param {Manifest} manifest @returns {Paint} */
export function blankPaint({ classes, materials, objects = [] }) {
  return { runs: classes?.painted ?? [], densities: objects.map(() => 1), offsets: materials.map(() => 0) };
}

/** The nearest multiple of 1 / steps within bounds. @param {number} v @param {number} steps @param {number[]} bounds */
export const snap = (v, steps, [low, high]) => Math.round(Math.min(Math.max(v, low), high) * steps) / steps;

/**
 * The content of the file: materials and objects by name, so that it outlives a change of their order.
 *
 * @param {Paint} paint
 * @param {Manifest} manifest
 */
export function describePaint({ runs, densities, offsets }, { materials, objects = [] }) {
  return {
    format: FORMAT, version: VERSION, materials: materials.map(({ name }) => name), runs,
    densities: Object.fromEntries(objects.map(({ name }, k) => [name, densities[k]])),
    offsets: Object.fromEntries(materials.map(({ name }, m) => [name, offsets[m]])),
  };
}

/** Is this meant to be a file of paint? @param {any} value */
export const isPaint = (value) => value?.format === FORMAT;

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
