// davgswt.json, checked before anything is drawn.

import { MOST_OCTAVES } from "./heights.js";
import { isEncoding, sizeOf, VERSION } from "./records.js";
import { LEVELS, ORDERS } from "./runs.js";

const FORMAT = "davgswt", MOST_TILES = 256, MOST_CELLS = 67_108_864;
export const AGAIN = "Make the page again with “make run”.";

/** Why a manifest cannot be used, or null. */
export function faultOf(m) {
  if (m === null || typeof m !== "object" || m.format !== FORMAT) {
    return `this is not a terrain (format “${m?.format}”, “${FORMAT}” is needed).`;
  }
  if (m.version !== VERSION) {
    return `the terrain has version ${m.version}, this page reads version ${VERSION}. ${AGAIN}`;
  }
  const broken = (what) => `“${what}” is missing or makes no sense. ${AGAIN}`;
  if (!positive(m.tile_side)) return broken("tile_side");
  if (!positive(m.eye_floor)) return broken("eye_floor");
  if (!Number.isInteger(m.salt) || m.salt < 0 || m.salt > 0xffffffff) return broken("salt");
  if (!vector(m.ground_colour)) return broken("ground_colour");
  if (!vector(m.sky?.zenith) || !vector(m.sky?.horizon)) return broken("sky");
  if (!isEncoding(m.encoding)) return broken("encoding");
  if (!filled(m.directions) || m.directions.length > ORDERS || !m.directions.every(vector)) return broken("directions");
  const levels = m.levels;
  const counted = filled(levels) && levels.every((level, l) => level?.level === l && rises(levels, l));
  if (!counted || levels.length > LEVELS) return broken("levels");
  if (!filled(m.tiles) || m.tiles.length % 16 || m.tiles.length > MOST_TILES) return broken("tiles");
  if (m.heights !== undefined && !surface(m.heights)) return broken("heights");
  return m.tiles.map((tile, t) => tileFault(m, tile, t)).find((fault) => fault) ?? null;
}

function tileFault(m, tile, t) {
  const heights = Array.isArray(tile?.z) && tile.z.length === 2 && tile.z.every(Number.isFinite);
  if (tile?.tile !== t || !heights || !Array.isArray(tile.chunks)) {
    return `tile ${t} is missing or makes no sense. ${AGAIN}`;
  }
  const levels = new Set(tile.chunks.map((chunk) => chunk?.level));
  if (levels.size !== m.levels.length || tile.chunks.length !== m.levels.length) {
    return `tile ${t} does not have one chunk for each of ${m.levels.length} levels. ${AGAIN}`;
  }
  for (const chunk of tile.chunks) {
    const sound = natural(chunk.level) && chunk.level < m.levels.length && natural(chunk.count) && filled(chunk.orders)
      && chunk.orders.every((d) => natural(d) && d < m.directions.length)
      && chunk.bytes === sizeOf(chunk.count, chunk.orders.length) && inside(chunk.file);
    if (!sound) return `the entry of chunk “${chunk.file}” contradicts itself. ${AGAIN}`;
  }
  return null;
}

/** Is this a surface that heights.js knows? */
function surface(h) {
  if (h?.kind === "flat") return true;
  if (h?.kind === "hills") {
    return Number.isFinite(h.height) && positive(h.wavelength) && natural(h.salt) && natural(h.octaves)
      && h.octaves > 0 && h.octaves <= MOST_OCTAVES;
  }
  return h?.kind === "image" && positive(h.width) && natural(h.rows) && natural(h.columns) && inside(h.file)
    && h.rows * h.columns > 0 && h.rows * h.columns <= MOST_CELLS && h.bytes === 4 * h.rows * h.columns;
}

const natural = (x) => Number.isInteger(x) && x >= 0;
const positive = (x) => Number.isFinite(x) && x > 0;
const filled = (list) => Array.isArray(list) && list.length > 0;
const vector = (v) => Array.isArray(v) && v.length === 3 && v.every(Number.isFinite);
export const inside = (file) => typeof file === "string" && /^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(file);

function rises(levels, l) {
  const far = levels[l].distance;
  if (l === levels.length - 1) return far === null;
  return Number.isFinite(far) && far >= (l ? levels[l - 1].distance : 0);
}

