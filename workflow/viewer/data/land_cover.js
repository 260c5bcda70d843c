// Materials, classes, objects and scatter of a manifest: their checks, and their keys that the page knows.

import { MAX_MATERIALS } from "../terrain/classes.js";
import { MAX_OCTAVES } from "../terrain/jitter.js";
import { findRunFault } from "../terrain/painted.js";
import { MAX_RADIUS } from "../terrain/scatter.js";
import {
  isColour, isCoordinate, isDigest, isFilled, isInside, isLength, isList, isName, isNatural, isRange, isSalt, isShare,
  isSize, isWhole,
} from "./checks.js";

/**
 * @typedef {import("../terrain/classes.js").ClassesEntry} ClassesEntry
 * @typedef {import("../terrain/classes.js").Term} Term
 * @typedef {{ name: string, share: number, first_tile: number, ground_colour: number[] }} MaterialEntry
 * @typedef {{ name: string, radius: number, z: number[], ground: number, material: number, density: number,
 *   probability: number, chunks: import("./manifest.js").ChunkEntry[] }} ObjectEntry
 */

const MAX_TERMS = 64, MAX_OBJECTS = 256, MAX_CELLS = 64; // of a rule; of a terrain; of the scatter along a tile's side
const MAX_SIDE = 4096, MAX_PIXELS = 2 ** 26; // pixels along a side of a picture of materials; of all pictures together
export const MAX_CANDIDATES = 512; // objects on a tile at most
const MAX_WAVES = 4096; // cells of the jitter along a tile's side
const UNTURNED = 180; // degrees

/**
 * The key of what makes no sense, or null.
 *
 * @param {any} m a manifest whose tiles have been counted
 */
export function findCoverFault({ materials, tiles, tile_side: side, classes, objects, scatter }) {
  const count = Array.isArray(materials) ? materials.length : 0, each = tiles.length / count;
  if (!isWhole(count, 1, MAX_MATERIALS) || tiles.length % (16 * count)
    || !materials.every((/** @type {any} */ one, /** @type {number} */ m) => isMaterial(one, m * each))) {
    return "materials";
  }
  if (count > 1 ? !areClasses(classes, count) : classes !== undefined) return "classes";
  if (objects === undefined) return scatter === undefined ? null : "scatter";
  const sound = isFilled(objects) && objects.length <= MAX_OBJECTS
    && objects.every((/** @type {any} */ one) => isObject(one, count, side));
  if (!sound) return "objects";
  return isScatter(scatter) ? null : "scatter";
}

/**
 * Why the objects of sound classes are too many, or null.
 *
 * @param {any} m
 */
export function findCrowd({ objects, scatter }) {
  if (!scatter) return null;
  const chance = objects.reduce((/** @type {number} */ sum, /** @type {any} */ one) => sum + one.probability, 0);
  const most = Math.ceil(scatter.cells ** 2 * Math.min(1, chance));
  if (most <= MAX_CANDIDATES) return null;
  return `up to ${most} objects stand on a tile, this page draws ${MAX_CANDIDATES}. Make fewer, or smaller tiles.`;
}

/** @param {any} one @param {number} firstTile */
const isMaterial = (one, firstTile) => isName(one?.name) && isShare(one.share) && one.first_tile === firstTile
  && isColour(one.ground_colour);

/** @param {any} classes @param {number} count of materials */
function areClasses(classes, count) {
  const { salt, rule, jitter, rise, painted } = classes ?? {};
  if (painted !== undefined && findRunFault(painted, count)) return false;
  if (!isSalt(salt) || !isFilled(rule) || rule.length > MAX_TERMS) return false;
  if (!rule.every((/** @type {any} */ term) => isSize(term?.weight) && isTerm(term, count))) return false;
  const pixels = rule.reduce((/** @type {number} */ sum, /** @type {any} */ term) => (
    sum + (term.kind === "image" ? term.bytes : 0)), 0);
  const files = rule.flatMap((/** @type {any} */ term) => (term.kind === "image" ? [term.file] : []));
  return pixels <= MAX_PIXELS && new Set(files).size === files.length
    && isWhole(jitter?.cells, 1, MAX_WAVES) && isWhole(jitter.octaves, 1, MAX_OCTAVES)
    && isSize(jitter.amplitude) && isSize(rise?.slope) && isSize(rise.most)
    && isList(rise.ground, count, isCoordinate) && isList(rise.clearance, count, isSize);
}

/** @param {any} term @param {number} count of materials */
function isTerm(term, count) {
  if (term.kind === "noise") {
    return isList(term.wavelengths, count, isLength) && isList(term.biases, count, isCoordinate)
      && isList(term.octaves, count, (octaves) => isWhole(octaves, 1, MAX_OCTAVES));
  }
  if (term.kind === "image") {
    return isInside(term.file) && isWhole(term.rows, 1, MAX_SIDE) && isWhole(term.columns, 1, MAX_SIDE)
      && isLength(term.width) && (term.beyond === "mirror" || term.beyond === "clamp")
      && term.bytes === term.rows * term.columns && isDigest(term.sha256);
  }
  /** @param {any} bound */
  const isBound = (bound) => bound === null || isCoordinate(bound);
  return (term.kind === "height" || term.kind === "slope") && isNatural(term.material) && term.material < count
    && isBound(term.low) && isBound(term.high) && isLength(term.soft);
}

/** All but its chunks. @param {any} one @param {number} count of materials @param {number} side of a tile */
const isObject = (one, count, side) => isName(one?.name) && isLength(one.radius) && one.radius <= MAX_RADIUS * side
  && isRange(one.z) && isCoordinate(one.ground) && isNatural(one.material) && one.material < count
  && isSize(one.density) && isShare(one.probability);

/** @param {any} scatter */
const isScatter = (scatter) => isWhole(scatter?.cells, 1, MAX_CELLS) && isSize(scatter.turn)
  && scatter.turn <= UNTURNED && isSize(scatter.size) && scatter.size < 1 && isSalt(scatter.salt);

/**
 * The keys of sound classes that the page knows.
 *
 * @param {ClassesEntry} classes
 * @returns {ClassesEntry}
 */
export function pickClasses({ salt, rule, jitter, rise, painted }) {
  return {
    ...(painted && { painted: painted.map(([i, j, length, m]) => [i, j, length, m]) }),
    salt, rule: rule.map(pickTerm),
    jitter: { cells: jitter.cells, octaves: jitter.octaves, amplitude: jitter.amplitude },
    rise: { slope: rise.slope, most: rise.most, ground: rise.ground, clearance: rise.clearance },
  };
}

/** @param {Term} term @returns {Term} */
function pickTerm(term) {
  if (term.kind === "noise") {
    const { kind, weight, wavelengths, octaves, biases } = term;
    return { kind, weight, wavelengths, octaves, biases };
  }
  if (term.kind === "image") {
    const { kind, weight, file, bytes, sha256, rows, columns, width, beyond } = term;
    return { kind, weight, file, bytes, sha256, rows, columns, width, beyond };
  }
  const { kind, weight, material, low, high, soft } = term;
  return { kind, weight, material, low, high, soft };
}
