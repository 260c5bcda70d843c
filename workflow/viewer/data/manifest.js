// davgswt.json, checked before anything is drawn.

import { MAX_OCTAVES } from "../terrain/heights.js";
import {
  brief, isColour, isCoordinate, isDigest, isDirection, isFilled, isInside, isLength, isNatural, isRange, isSalt,
  isShare, isVector, isWhole,
} from "./checks.js";
import { REMAKE } from "./checks.js";
import { findCoverFault, findCrowd, pickClasses } from "./land_cover.js";
import { CACHE_BYTES, MAX_COUNT, MAX_LEVELS, MAX_ORDERS } from "./layout.js";
import { chunkBytes, deviationOf, isEncoding, OLDEST, VERSION } from "./layout.js";

/**
 * @typedef {{ level: number, file: string, bytes: number, count: number, orders: number[],
 *   sha256?: string }} ChunkEntry
 * @typedef {{ tile: number, uncertainty?: number, z: number[], chunks: ChunkEntry[] }} TileEntry
 * @typedef {{ level: number, mean_scale?: number, distance: number | null, band?: number }} LevelEntry
 * @typedef {{ zenith: number[], horizon: number[], sun?: { direction: number[], colour?: number[] } }} Sky
 * @typedef {{ format: string, version: number, unit: string, tile_side: number, salt: number, eye_floor: number,
 *   ground_colour: number[], sky: Sky, encoding: import("./layout.js").Encoding, directions: number[][],
 *   levels: LevelEntry[], tiles: TileEntry[], materials: import("./land_cover.js").MaterialEntry[],
 *   classes?: import("../terrain/classes.js").ClassesEntry, objects?: import("./land_cover.js").ObjectEntry[],
 *   scatter?: import("../terrain/scatter.js").ScatterEntry,
 *   heights?: import("../terrain/heights.js").HeightsEntry }} Manifest
 */

export const NAME = "davgswt.json";
export const MAX_TILES = 256; // of a material
const FORMAT = "davgswt", MAX_SIDE = 4096; // pixels along a side of a height map
const MAX_CELLS = 1 << 24; // along the side of a planet's face
const WIDEST = 8; // of deviations, in tile sides

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
  if (m.version !== VERSION && m.version !== OLDEST) {
    return `the terrain has version ${brief(m.version)}, this page reads version ${OLDEST} and ${VERSION}. ${REMAKE}`;
  }
  /** @param {string} what */
  const broken = (what) => `“${what}” is missing or makes no sense. ${REMAKE}`;
  if (typeof m.unit !== "string" || m.unit.length > 40) return broken("unit");
  if (!isLength(m.tile_side)) return broken("tile_side");
  if (!isLength(m.eye_floor)) return broken("eye_floor");
  if (!isSalt(m.salt)) return broken("salt");
  if (!isColour(m.ground_colour)) return broken("ground_colour");
  if (!isSky(m.sky)) return broken("sky");
  if (!isEncoding(m.encoding) || !(deviationOf(m.encoding, 255) <= WIDEST * m.tile_side)) return broken("encoding");
  if (!isFilled(m.directions) || m.directions.length > MAX_ORDERS || !m.directions.every(isDirection)) {
    return broken("directions");
  }
  if (!areLevels(m.levels)) return broken("levels");
  const count = m.version === VERSION && isFilled(m.materials) ? m.materials.length : 1;
  if (!isFilled(m.tiles) || m.tiles.length % 16 || m.tiles.length > MAX_TILES * count) return broken("tiles");
  const uncovered = m.version === VERSION ? findCoverFault(m) : null;
  if (uncovered) return broken(uncovered);
  const crowd = m.version === VERSION ? findCrowd(m) : null;
  if (crowd) return crowd;
  if (m.heights !== undefined && !isSurface(m.heights, m.tile_side)) return broken("heights");
  if (m.heights?.kind === "sphere" && (m.classes || m.objects?.length)) return broken("heights");
  for (let t = 0; t < m.tiles.length; t++) {
    const fault = findTileFault(m, m.tiles[t], t);
    if (fault) return fault;
  }
  const objects = m.version === VERSION ? m.objects ?? [] : [];
  for (let k = 0; k < objects.length; k++) {
    const fault = findChunkFault(m, objects[k].chunks, `object ${k}`);
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
  if (tile?.tile !== t || !isRange(tile.z) || !isShare(tile.uncertainty ?? 0)) {
    return `tile ${t} is missing or makes no sense. ${REMAKE}`;
  }
  return findChunkFault(m, tile.chunks, `tile ${t}`);
}

/**
 * @param {any} m
 * @param {any} chunks
 * @param {string} owner
 */
function findChunkFault(m, chunks, owner) {
  if (!Array.isArray(chunks)) return `${owner} is missing or makes no sense. ${REMAKE}`;
  const levels = new Set(chunks.map((/** @type {any} */ chunk) => chunk?.level));
  if (levels.size !== m.levels.length || chunks.length !== m.levels.length) {
    return `${owner} does not have one chunk for each of ${m.levels.length} levels. ${REMAKE}`;
  }
  for (const chunk of chunks) {
    const sound = isNatural(chunk?.level) && chunk.level < m.levels.length && isNatural(chunk.count) && chunk.count > 0
      && areOrders(chunk.orders, m.directions.length)
      && chunk.bytes === chunkBytes(chunk.count, chunk.orders.length) && isInside(chunk.file) && isDigest(chunk.sha256);
    if (!sound) return `the entry of chunk “${brief(chunk?.file)}” contradicts itself. ${REMAKE}`;
    if (chunk.count > MAX_COUNT || chunk.bytes > CACHE_BYTES) {
      return `the chunk “${chunk.file}” has ${chunk.bytes} bytes, more than this page holds. Make smaller tiles.`;
    }
  }
  return null;
}

/** Are these different numbers of directions? @param {any} orders @param {number} directions */
const areOrders = (orders, directions) => isFilled(orders) && orders.length <= directions
  && orders.every((/** @type {any} */ d) => isNatural(d) && d < directions) && new Set(orders).size === orders.length;

/**
 * The keys of a sound manifest that the page knows: nothing else of a file is kept or passed on.
 *
 * @param {Manifest} manifest
 * @returns {Manifest}
 */
export function pickKnown({
  format, version, unit, tile_side, salt, eye_floor, ground_colour, sky, encoding, directions, levels, tiles, heights,
  ...cover
}) {
  const { origin, step, log_scale, sh_degree } = encoding, { zenith, horizon, sun } = sky;
  return {
    format, version, unit, tile_side, salt, eye_floor, ground_colour, directions,
    sky: sun ? { zenith, horizon, sun: { direction: sun.direction, colour: sun.colour } } : { zenith, horizon },
    encoding: { origin, step, log_scale, sh_degree },
    levels: levels.map(({ level, mean_scale, distance, band }) => ({ level, mean_scale, distance, band })),
    tiles: tiles.map(({ tile, uncertainty, z, chunks }) => ({ tile, uncertainty, z, chunks: chunks.map(pickChunk) })),
    heights: heights && pickHeights(heights),
    ...(version === OLDEST ? { materials: [onlyMaterial(ground_colour)] } : pickCover(cover)),
  };
}

/** What version 2 does not name. @param {number[]} colour */
const onlyMaterial = (colour) => ({ name: "ground", share: 1, first_tile: 0, ground_colour: colour });

/** @param {ChunkEntry} chunk @returns {ChunkEntry} */
const pickChunk = ({ level, file, bytes, count, orders, sha256 }) => ({ level, file, bytes, count, orders, sha256 });

/** @param {Pick<Manifest, "materials" | "classes" | "objects" | "scatter">} cover */
function pickCover({ materials, classes, objects, scatter }) {
  return {
    materials: materials.map(({ name, share, first_tile, ground_colour }) => (
      { name, share, first_tile, ground_colour })),
    classes: classes && pickClasses(classes),
    objects: objects?.map(({ name, radius, z, ground, material, density, probability, chunks }) => (
      { name, radius, z, ground, material, density, probability, chunks: chunks.map(pickChunk) })),
    scatter: scatter && { cells: scatter.cells, turn: scatter.turn, size: scatter.size, salt: scatter.salt },
  };
}

/**
 * @param {import("../terrain/heights.js").HeightsEntry} entry
 * @returns {import("../terrain/heights.js").HeightsEntry}
 */
function pickHeights(entry) {
  if (entry.kind === "flat") return { kind: "flat" };
  if (entry.kind === "hills") {
    const { kind, height, wavelength, octaves, salt } = entry;
    return { kind, height, wavelength, octaves, salt };
  }
  if (entry.kind === "sphere") return { kind: "sphere", radius: entry.radius, cells: entry.cells };
  const { kind, file, bytes, sha256, rows, columns, width, beyond } = entry;
  return { kind, file, bytes, sha256, rows, columns, width, beyond };
}

/** @param {any} levels */
function areLevels(levels) {
  return isFilled(levels) && levels.length <= MAX_LEVELS
    && levels.every((/** @type {any} */ level, /** @type {number} */ l) => level?.level === l && rises(levels, l));
}

/** @param {any[]} levels @param {number} l */
function rises(levels, l) {
  const { distance: far, band = 0, mean_scale: scale = 0 } = levels[l];
  if (!isCoordinate(scale) || !isCoordinate(band) || band < 0) return false;
  if (l === levels.length - 1) return far === null;
  return isCoordinate(far) && far >= (l ? levels[l - 1].distance : 0);
}

/**
 * Is this a surface that terrain/heights.js knows?
 *
 * @param {any} h
 * @param {number} side of a tile
 */
function isSurface(h, side) {
  if (h?.kind === "flat") return true;
  if (h?.kind === "sphere") return isPlanet(h, side);
  if (h?.kind === "hills") {
    return isCoordinate(h.height) && isLength(h.wavelength) && isSalt(h.salt) && isNatural(h.octaves)
      && h.octaves > 0 && h.octaves <= MAX_OCTAVES;
  }
  return h?.kind === "image" && isLength(h.width) && isNatural(h.rows) && isNatural(h.columns) && isInside(h.file)
    && h.rows > 0 && h.columns > 0 && Math.max(h.rows, h.columns) <= MAX_SIDE && h.bytes === 4 * h.rows * h.columns
    && isDigest(h.sha256);
}

/** A planet whose cells are about as large as its tiles: more would be in view than can be drawn. @param {any} h @param {number} side */
const isPlanet = (h, side) => isLength(h.radius) && h.radius >= side && isWhole(h.cells, 1, MAX_CELLS)
  && Math.abs(h.cells - (h.radius / side) * Math.sqrt((2 * Math.PI) / 3)) <= 1;

/** @param {any} sky */
const isSky = (sky) => isColour(sky?.zenith) && isColour(sky.horizon) && (sky.sun === undefined
  || (isVector(sky.sun?.direction) && Math.hypot(...sky.sun.direction) > 0
    && (sky.sun.colour === undefined || isVector(sky.sun.colour))));
