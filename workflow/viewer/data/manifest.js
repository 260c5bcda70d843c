// davgswt.json, checked before anything is drawn.

import { MAX_OCTAVES } from "../terrain/heights.js";
import { REMAKE } from "./errors.js";
import { MAX_LEVELS, MAX_ORDERS } from "./layout.js";
import { chunkBytes, isEncoding, VERSION } from "./records.js";

/**
 * @typedef {{ level: number, file: string, bytes: number, count: number, orders: number[],
 *   sha256?: string }} ChunkEntry
 * @typedef {{ tile: number, uncertainty?: number, z: number[], chunks: ChunkEntry[] }} TileEntry
 * @typedef {{ level: number, mean_scale?: number, distance: number | null, band?: number }} LevelEntry
 * @typedef {{ zenith: number[], horizon: number[], sun?: { direction: number[], colour?: number[] } }} Sky
 * @typedef {{ format: string, version: number, unit: string, tile_side: number, salt: number, eye_floor: number,
 *   ground_colour: number[], sky: Sky, encoding: import("./records.js").Encoding, directions: number[][],
 *   levels: LevelEntry[], tiles: TileEntry[], heights?: import("../terrain/heights.js").HeightsEntry }} Manifest
 */

export const NAME = "davgswt.json";
const FORMAT = "davgswt", MAX_TILES = 256, MAX_PIXELS = 67_108_864;

/**
 * Why a manifest cannot be used, or null.
 *
 * @param {any} m parsed JSON
 * @returns {string | null}
 */
export function findFault(m) {
  if (m === null || typeof m !== "object" || m.format !== FORMAT) {
    return `this is not a terrain (format “${m?.format}”, “${FORMAT}” is needed).`;
  }
  if (m.version !== VERSION) {
    return `the terrain has version ${m.version}, this page reads version ${VERSION}. ${REMAKE}`;
  }
  /** @param {string} what */
  const broken = (what) => `“${what}” is missing or makes no sense. ${REMAKE}`;
  if (!isPositive(m.tile_side)) return broken("tile_side");
  if (!isPositive(m.eye_floor)) return broken("eye_floor");
  if (!Number.isInteger(m.salt) || m.salt < 0 || m.salt > 0xffffffff) return broken("salt");
  if (!isVector(m.ground_colour)) return broken("ground_colour");
  if (!isVector(m.sky?.zenith) || !isVector(m.sky?.horizon)) return broken("sky");
  if (!isEncoding(m.encoding)) return broken("encoding");
  if (!isFilled(m.directions) || m.directions.length > MAX_ORDERS || !m.directions.every(isVector)) {
    return broken("directions");
  }
  if (!areLevels(m.levels)) return broken("levels");
  if (!isFilled(m.tiles) || m.tiles.length % 16 || m.tiles.length > MAX_TILES) return broken("tiles");
  if (m.heights !== undefined && !isSurface(m.heights)) return broken("heights");
  for (let t = 0; t < m.tiles.length; t++) {
    const fault = findTileFault(m, m.tiles[t], t);
    if (fault) return fault;
  }
  return null;
}

/**
 * @param {any} m
 * @param {any} tile
 * @param {number} t
 */
function findTileFault(m, tile, t) {
  const heights = Array.isArray(tile?.z) && tile.z.length === 2 && tile.z.every(Number.isFinite);
  if (tile?.tile !== t || !heights || !Array.isArray(tile.chunks)) {
    return `tile ${t} is missing or makes no sense. ${REMAKE}`;
  }
  const levels = new Set(tile.chunks.map((/** @type {any} */ chunk) => chunk?.level));
  if (levels.size !== m.levels.length || tile.chunks.length !== m.levels.length) {
    return `tile ${t} does not have one chunk for each of ${m.levels.length} levels. ${REMAKE}`;
  }
  for (const chunk of tile.chunks) {
    const sound = isNatural(chunk.level) && chunk.level < m.levels.length && isNatural(chunk.count)
      && isFilled(chunk.orders)
      && chunk.orders.every((/** @type {any} */ d) => isNatural(d) && d < m.directions.length)
      && chunk.bytes === chunkBytes(chunk.count, chunk.orders.length) && isInside(chunk.file);
    if (!sound) return `the entry of chunk “${chunk.file}” contradicts itself. ${REMAKE}`;
  }
  return null;
}

/** @param {any} levels */
function areLevels(levels) {
  return isFilled(levels) && levels.length <= MAX_LEVELS
    && levels.every((/** @type {any} */ level, /** @type {number} */ l) => level?.level === l && rises(levels, l));
}

/** @param {any[]} levels @param {number} l */
function rises(levels, l) {
  const far = levels[l].distance;
  if (l === levels.length - 1) return far === null;
  return Number.isFinite(far) && far >= (l ? levels[l - 1].distance : 0);
}

/**
 * Is this a surface that terrain/heights.js knows?
 *
 * @param {any} h
 */
function isSurface(h) {
  if (h?.kind === "flat") return true;
  if (h?.kind === "hills") {
    return Number.isFinite(h.height) && isPositive(h.wavelength) && isNatural(h.salt) && isNatural(h.octaves)
      && h.octaves > 0 && h.octaves <= MAX_OCTAVES;
  }
  return h?.kind === "image" && isPositive(h.width) && isNatural(h.rows) && isNatural(h.columns) && isInside(h.file)
    && h.rows * h.columns > 0 && h.rows * h.columns <= MAX_PIXELS && h.bytes === 4 * h.rows * h.columns;
}

/** @param {any} x */
const isNatural = (x) => Number.isInteger(x) && x >= 0;
/** @param {any} x */
const isPositive = (x) => Number.isFinite(x) && x > 0;
/** @param {any} list */
const isFilled = (list) => Array.isArray(list) && list.length > 0;
/** @param {any} v */
const isVector = (v) => Array.isArray(v) && v.length === 3 && v.every(Number.isFinite);
/** A relative path that stays in the bundle. @param {any} file */
const isInside = (file) => typeof file === "string" && /^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(file);
