// davgswt.json, checked before anything is drawn: the bundle, its materials, classes, objects and scatter.

import { MAX_MATERIALS } from "../terrain/classes.js";
import { MAX_OCTAVES } from "../terrain/heights.js";
import { LOWEST } from "../terrain/light.js";
import { findRunFault } from "../terrain/painted.js";
import { MAX_RADIUS } from "../terrain/scatter.js";
import { MAX_OCTAVES as MAX_JITTER, MAX_WAVES as MAX_VARIATION } from "../terrain/variation.js";
import {
  brief, isColour, isCoordinate, isDigest, isDirection, isFilled, isInside, isLength, isList, isName, isNatural,
  isRange, isSalt, isShare, isSize, isVector, isWhole, REMAKE,
} from "./checks.js";
import { PLANES } from "./compose.js";
import {
  CACHE_BYTES, chunkBytes, deviationOf, isEncoding, MAX_COUNT, MAX_LEVELS, MAX_ORDERS, MAX_STEPS, RECORD, VERSION,
  viewRoom,
} from "./layout.js";
import { MAX_RATIO } from "./source.js";

/**
 * A file of the bundle, and what it unpacks to; a chunk: of records from `first` on in a part, or composed; and how the
 * composed levels are made.
 * @typedef {{ kind: string, file: string, bytes: number, size: number, sha256?: string, level?: number }} PartEntry
 * @typedef {{ level: number, count: number, part?: number, first?: number }} ChunkEntry
 * @typedef {{ side: number, cell: number, levels: number, exemplars: number[] }} Composition
 * @typedef {{ tile: number, uncertainty?: number, z: number[], orders: number[], chunks: ChunkEntry[] }} TileEntry
 * @typedef {{ level: number, mean_scale?: number, distance: number | null, band?: number }} LevelEntry
 * @typedef {{ zenith: number[], horizon: number[], sun?: { direction: number[], colour?: number[] } }} Sky
 * @typedef {{ name: string, share: number, first_tile: number, ground_colour: number[] }} MaterialEntry
 * @typedef {{ name: string, radius: number, z: number[], ground: number, material: number, density: number,
 *   probability: number, orders: number[], chunks: ChunkEntry[] }} ObjectEntry
 * @typedef {{ format: string, version: number, unit: string, tile_side: number, salt: number, eye_floor: number,
 *   ground_colour: number[], sky: Sky, encoding: import("./layout.js").Encoding, directions: number[][],
 *   levels: LevelEntry[], parts: PartEntry[], composition?: Composition, tiles: TileEntry[],
 *   materials: MaterialEntry[],
 *   classes?: import("../terrain/classes.js").ClassesEntry, objects?: ObjectEntry[],
 *   scatter?: import("../terrain/scatter.js").ScatterEntry, variation?: import("../terrain/variation.js").Wave[],
 *   heights?: import("../terrain/heights.js").HeightsEntry, light?: import("../terrain/light.js").LightEntry,
 *   wind?: number }} Manifest
 */

export const NAME = "davgswt.json";
export const KINDS = new Set(["records", "plain", "recipes", "level"]); // of parts; others are for later pages
export const MAX_TILES = 256; // of a material
export const MAX_CANDIDATES = 512; // objects on a tile at most
const FORMAT = "davgswt", MAX_SIDE = 4096; // pixels along a side of a height map
const MAX_FACE = 1 << 24; // cells along the side of a planet's face
const WIDEST = 8; // of deviations, in tile sides
const MAX_TERMS = 64, MAX_OBJECTS = 256, MAX_CELLS = 64; // of a rule; of a terrain; of the scatter along a tile's side
/** @type {Record<string, number>} */
const UNITS = { records: PLANES, plain: RECORD }; // bytes of a splat
const MAX_PARTS = 1024, MAX_UNPACKED = 2 ** 29; // bytes of all parts
const WHOLE = 1e-9; // relative error of whole numbers of steps
const NARROWEST = 0.01, BROADEST = 1e4; // cells of the variation, in tile sides
const MAX_GROUND = 4096; // along a tile or an exemplar
const MAX_WAVES = 4096; // cells of the jitter along a tile's side
const UNTURNED = 180; // degrees
const SUNS = new Set(["config", "exif", "relief", "assumed"]); // where the captured sun is known from
const STRONGEST = 4; // wind
const DEEPEST = 6; // levels of lists and objects within a manifest
const KEYS = new Set(`format version unit tile_side salt eye_floor ground_colour sky zenith horizon
  sun direction colour encoding origin step log_scale sh_degree directions levels level mean_scale
  distance band tiles tile uncertainty z chunks file bytes count orders sha256 heights kind height
  parts part first composition side cell exemplars
  wavelength octaves radius cells rows columns width materials name share first_tile classes
  rule weight wavelengths biases material low high soft jitter amplitude rise slope most ground
  clearance painted objects density probability scatter turn size variation colours gains
  light elevation azimuth source north wind`.split(/\s+/));

/**
 * What each part of a manifest must be, given the whole; the parts before it are sound.
 *
 * @type {Record<string, (value: any, m: any) => boolean>}
 */
const PARTS = {
  unit: (unit) => typeof unit === "string" && unit.length <= 40,
  tile_side: isLength,
  eye_floor: isLength,
  salt: isSalt,
  ground_colour: isColour,
  sky: (sky) => isColour(sky?.zenith) && isColour(sky.horizon) && (sky.sun === undefined
    || (isVector(sky.sun?.direction) && Math.hypot(...sky.sun.direction) > 0
      && (sky.sun.colour === undefined || isVector(sky.sun.colour)))),
  encoding: (encoding, m) => isEncoding(encoding) && deviationOf(encoding, 255) <= WIDEST * m.tile_side,
  directions: (list) => isFilled(list) && list.length <= MAX_ORDERS && list.every(isDirection),
  levels: (list) => isFilled(list) && list.length <= MAX_LEVELS
    && list.every((/** @type {any} */ level, /** @type {number} */ l) => level?.level === l && rises(list, l)),
  tiles: (tiles, { materials }) => isFilled(tiles) && tiles.length % 16 === 0
    && tiles.length <= MAX_TILES * (isFilled(materials) ? materials.length : 1),
  materials: (materials, { tiles }) => Array.isArray(materials) && isWhole(materials.length, 1, MAX_MATERIALS)
    && tiles.length % (16 * materials.length) === 0
    && materials.every((one, m) => isMaterial(one, (m * tiles.length) / materials.length)),
  parts: (parts) => isFilled(parts) && parts.length <= MAX_PARTS && parts.every(isPart)
    && new Set(parts.map((/** @type {any} */ part) => part.file ?? part)).size === parts.length
    && parts.reduce((/** @type {number} */ sum, /** @type {any} */ { kind, size }) => (
      KINDS.has(kind) ? sum + size : sum), 0) <= MAX_UNPACKED,
  composition: (composition, m) => (composition ? isComposition(composition, m)
    : composition === undefined && m.parts.every((/** @type {any} */ { kind }) => !KINDS.has(kind) || UNITS[kind])),
  classes: (classes, { materials: { length } }) => (length > 1 ? areClasses(classes, length) : classes === undefined),
  objects: (objects, { materials, tile_side: side }) => objects === undefined
    || (isFilled(objects) && objects.length <= MAX_OBJECTS
      && objects.every((/** @type {any} */ one) => isObject(one, materials.length, side))),
  scatter: (scatter, { objects }) => (objects ? isScatter(scatter) : scatter === undefined),
  variation: (waves, { materials: { length } }) => waves === undefined || (isFilled(waves) && waves.length <= MAX_VARIATION
    && waves.every((/** @type {any} */ wave) => isWave(wave, length))),
  heights: (heights, m) => heights === undefined || (isSurface(heights, m.tile_side)
    && !(heights.kind === "sphere" && (m.classes || m.objects))),
  light: (light) => light === undefined || (isCoordinate(light?.elevation) && light.elevation >= LOWEST
    && light.elevation <= 90 && isSize(light.azimuth) && light.azimuth < 360 && SUNS.has(light.source)
    && (light.north === undefined || (isSize(light.north) && light.north < 360))),
  wind: (wind) => wind === undefined || (isSize(wind) && wind <= STRONGEST),
};

/**
 * Why a manifest cannot be used, or null.
 *
 * @param {any} m parsed JSON
 * @returns {string | null}
 */
export function findFault(m) {
  if (m === null || typeof m !== "object" || m.format !== FORMAT) {
    return `this is not a terrain (format “${brief(m?.format)}”, “${FORMAT}” is needed).`;
  }
  if (m.version !== VERSION) {
    return `the terrain is a bundle of version ${brief(m.version)}, this page reads version ${VERSION}. `
      + "Make it again: “dav-gswt make” (or the workflow) on its scene.";
  }
  for (const [key, isSound] of Object.entries(PARTS)) {
    if (!isSound(m[key], m)) return `“${key}” is missing or makes no sense. ${REMAKE}`;
  }
  const { tiles, objects = [] } = m;
  for (const [t, tile] of tiles.entries()) {
    const sound = tile?.tile === t && isRange(tile.z) && isShare(tile.uncertainty ?? 0);
    const fault = findChunkFault(m, sound ? tile : {}, `tile ${t}`, m.composition?.levels ?? 0);
    if (fault) return fault;
  }
  for (const [k, object] of objects.entries()) {
    const fault = findChunkFault(m, object, `object ${k}`, 0);
    if (fault) return fault;
  }
  const room = viewRoom(m);
  if (room && Math.min(room.bytes, room.rows) < 0) {
    return "its coarsest level has more splats than this page holds. Make fewer tiles, or another level.";
  }
  return findCrowd(m);
}

/** Why the objects are too many, or null. @param {any} m */
function findCrowd({ objects, scatter }) {
  if (!scatter) return null;
  const chance = objects.reduce((/** @type {number} */ sum, /** @type {any} */ one) => sum + one.probability, 0);
  const most = Math.ceil(scatter.cells ** 2 * Math.min(1, chance));
  if (most <= MAX_CANDIDATES) return null;
  return `up to ${most} objects stand on a tile, this page draws ${MAX_CANDIDATES}. Make fewer, or smaller tiles.`;
}

/** @param {any} m @param {any} entry @param {string} owner @param {number} composed levels */
function findChunkFault(m, { chunks, orders }, owner, composed) {
  if (!Array.isArray(chunks)) return `${owner} is missing or makes no sense. ${REMAKE}`;
  if (!areOrders(orders, m.directions.length)) return `the orders of ${owner} make no sense. ${REMAKE}`;
  const levels = new Set(chunks.map((/** @type {any} */ chunk) => chunk?.level));
  if (levels.size !== m.levels.length || chunks.length !== m.levels.length) {
    return `${owner} does not have one chunk for each of ${m.levels.length} levels. ${REMAKE}`;
  }
  for (const chunk of chunks) {
    const sound = isNatural(chunk?.level) && chunk.level < m.levels.length && isNatural(chunk.count) && chunk.count > 0
      && (chunk.level < composed ? chunk.part === undefined : isStored(chunk, m.parts));
    if (!sound) return `the chunk of level ${brief(chunk?.level)} of ${owner} contradicts itself. ${REMAKE}`;
    if (chunk.count > MAX_COUNT || chunkBytes(chunk.count) > CACHE_BYTES) {
      return `level ${chunk.level} of ${owner} has ${chunk.count} splats, too many for this page. Make smaller tiles.`;
    }
  }
  return null;
}

/** Does a part hold the records of a chunk? @param {any} chunk @param {any[]} parts */
const isStored = ({ part, first, count }, parts) => isNatural(part) && isNatural(first)
  && UNITS[parts[part]?.kind] * (first + count) <= parts[part]?.size;

/** @param {any} part */
function isPart(part) {
  if (typeof part?.kind !== "string") return false;
  if (!KINDS.has(part.kind)) return true;
  const { kind, file, bytes, size, sha256, level } = part;
  return typeof file === "string" && /^parts\/\w{1,100}\.bin$/.test(file) && isDigest(sha256)
    && isWhole(bytes, 1, MAX_UNPACKED) && isWhole(size, 1, MAX_RATIO * bytes)
    && size % (UNITS[kind] ?? 1) === 0 && bytes <= 1.001 * size + 64
    && (kind === "plain" ? size === bytes : sha256 !== undefined)
    && (kind === "level") === (level !== undefined) && (kind !== "level" || isNatural(level));
}

/** @param {number} x */
const isNearWhole = (x) => Math.abs(x - Math.round(x)) <= WHOLE * Math.max(1, Math.abs(x));

/** @param {any} composition @param {any} m */
function isComposition(composition, { tile_side: long, encoding: { origin, step }, levels, materials, parts }) {
  const { side, cell, levels: many, exemplars } = composition;
  if (!isWhole(side, 1, MAX_GROUND) || !isWhole(cell, 1, MAX_STEPS) || !isWhole(many, 1, levels.length)) return false;
  if (side % 2 ** (many - 1) || !isList(exemplars, materials.length, (m) => isWhole(m, 1, MAX_GROUND))) return false;
  const fits = [0, 1].every((axis) => Math.abs(side * cell * step[axis] - long) <= WHOLE * long
    && isNearWhole(-origin[axis] / step[axis])
    && isWhole(Math.round(-origin[axis] / step[axis]) || 0, 0, MAX_STEPS - side * cell));
  /** @param {string} kind */
  const listed = (kind) => parts.filter((/** @type {any} */ part) => part.kind === kind);
  const stored = listed("level").map((/** @type {any} */ { level }) => level);
  return fits && listed("recipes").length === 1 && stored.length === many && new Set(stored).size === many
    && stored.every((/** @type {number} */ level) => level < many);
}

/**
 * The parts of a sound manifest that the page knows: nothing else of a file is kept or passed on.
 *
 * @param {any} value @param {number} [depth]
 * @returns {any}
 */
export function pickKnown(value, depth = 0) {
  if (value === null || typeof value !== "object") return value;
  if (depth >= DEEPEST) return undefined;
  if (Array.isArray(value)) return value.map((one) => pickKnown(one, depth + 1));
  const known = Object.entries(value).filter(([key]) => KEYS.has(key));
  return Object.fromEntries(known.map(([key, one]) => [key, pickKnown(one, depth + 1)]));
}

/** Are these different numbers of directions? @param {any} orders @param {number} directions */
const areOrders = (orders, directions) => isFilled(orders) && orders.length <= directions
  && orders.every((/** @type {any} */ d) => isNatural(d) && d < directions) && new Set(orders).size === orders.length;

/** @param {any[]} levels @param {number} l */
function rises(levels, l) {
  const { distance: far, band = 0, mean_scale: scale = 0 } = levels[l];
  if (!isCoordinate(scale) || !isCoordinate(band) || band < 0) return false;
  if (l === levels.length - 1) return far === null;
  return isCoordinate(far) && far >= (l ? levels[l - 1].distance : 0);
}

/** Is this a surface that terrain/heights.js knows? @param {any} h @param {number} side of a tile */
function isSurface(h, side) {
  if (h?.kind === "flat") return true;
  if (h?.kind === "sphere") { // its cells are about as large as its tiles: more would be in view than can be drawn
    return isLength(h.radius) && h.radius >= side && isWhole(h.cells, 1, MAX_FACE)
      && Math.abs(h.cells - (h.radius / side) * Math.sqrt((2 * Math.PI) / 3)) <= 1;
  }
  if (h?.kind === "hills") {
    return isCoordinate(h.height) && isLength(h.wavelength) && isSalt(h.salt) && isWhole(h.octaves, 1, MAX_OCTAVES);
  }
  return h?.kind === "image" && isInside(h.file) && [h.rows, h.columns].every((n) => isWhole(n, 1, MAX_SIDE))
    && isLength(h.width) && h.bytes === 4 * h.rows * h.columns && isDigest(h.sha256);
}

/** @param {any} wave @param {number} count of materials */
const isWave = (wave, count) => isCoordinate(wave?.wavelength) && wave.wavelength >= NARROWEST && wave.wavelength <= BROADEST
  && isList(wave.colours, count, (colour) => isList(colour, 3, (v) => isCoordinate(v) && Math.abs(v) <= 1));

/** @param {any} one @param {number} firstTile */
const isMaterial = (one, firstTile) => isName(one?.name) && isShare(one.share) && one.first_tile === firstTile
  && isColour(one.ground_colour);

/** @param {any} classes @param {number} count of materials */
function areClasses(classes, count) {
  const { salt, rule, jitter, rise, painted } = classes ?? {};
  if (painted !== undefined && findRunFault(painted, count)) return false;
  if (!isSalt(salt) || !isFilled(rule) || rule.length > MAX_TERMS) return false;
  if (!rule.every((/** @type {any} */ term) => isSize(term?.weight) && isTerm(term, count))) return false;
  return isWhole(jitter?.cells, 1, MAX_WAVES) && areGains(jitter.gains)
    && isSize(jitter.amplitude) && isSize(rise?.slope) && isSize(rise.most)
    && isList(rise.ground, count, isCoordinate) && isList(rise.clearance, count, isSize);
}

/** Of the octaves of a noise. @param {any} gains */
const areGains = (gains) => isFilled(gains) && gains.length <= MAX_JITTER && gains.every(isShare) && gains.some(Boolean);

/** @param {any} term @param {number} count of materials */
function isTerm(term, count) {
  if (term.kind === "noise") {
    return isList(term.wavelengths, count, isLength) && isList(term.biases, count, isCoordinate)
      && isList(term.gains, count, areGains);
  }
  /** @param {any} bound */
  const isBound = (bound) => bound === null || isCoordinate(bound);
  return (term.kind === "height" || term.kind === "slope") && isWhole(term.material, 0, count - 1)
    && isBound(term.low) && isBound(term.high) && isLength(term.soft);
}

/** All but its chunks. @param {any} one @param {number} count of materials @param {number} side of a tile */
const isObject = (one, count, side) => isName(one?.name) && isLength(one.radius) && one.radius <= MAX_RADIUS * side
  && isRange(one.z) && isCoordinate(one.ground) && isWhole(one.material, 0, count - 1)
  && isSize(one.density) && isShare(one.probability);

/** @param {any} scatter */
const isScatter = (scatter) => isWhole(scatter?.cells, 1, MAX_CELLS) && isSize(scatter.turn)
  && scatter.turn <= UNTURNED && isSize(scatter.size) && scatter.size < 1 && isSalt(scatter.salt);
