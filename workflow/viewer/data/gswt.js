// A gswt.zip: tiles as PLY files for the public GSWT renderer, converted to a bundle of plain records. It holds no
// distances or surface; these are computed as dav_gswt/bundle/manifest.py does, and Gaussians are quantized to the same
// grid, steps and bytes as by dav_gswt/bundle/encoding.py.

import { PageError, REMAKE_SET } from "./checks.js";
import { MAX_LEVELS, MAX_TURN, RECORD, TURN_STEPS, VERSION } from "./layout.js";
import { MAX_TILES, NAME } from "./manifest.js";
import { fileSource, tooLarge } from "./source.js";

/**
 * Gaussians in flat lists; turns: quaternions w x y z; paint: colour and opacity, 4 bytes each.
 *
 * @typedef {{ count: number, centres: Float32Array, logScales: Float32Array, turns: Float32Array,
 *   paint: Uint8Array | Uint8ClampedArray }} Gaussians
 * @typedef {import("./layout.js").Encoding} Encoding
 */

const PLACES = 65535, MIN_STEPS = 1024; // steps of the grid along an axis; fewest of them along a tile's side
const SIZES = 255; // steps of the logarithm of a deviation
const THINNEST = 1 / 64, WIDEST = 4; // bounds of axes: in pixels, in tile sides

/**
 * The finest grid that holds all these Gaussians; null: they spread too far.
 *
 * @param {Gaussians[]} sets @param {number} side
 * @param {number} pixel size of a pixel on the nearest ground in view
 * @returns {Encoding | null}
 */
export function fitEncoding(sets, side, pixel) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  let least = Infinity, largest = -Infinity;
  for (const { centres, logScales } of sets) {
    for (let k = 0; k < centres.length; k++) {
      low[k % 3] = Math.min(low[k % 3], centres[k]);
      high[k % 3] = Math.max(high[k % 3], centres[k]);
      least = Math.min(least, logScales[k]);
      largest = Math.max(largest, logScales[k]);
    }
  }
  /** @param {number} v */
  const clip = (v) => Math.min(Math.max(v, Math.log(THINNEST * pixel)), Math.log(WIDEST * side));
  let west = Math.min(0, low[0], low[1]);
  const east = Math.max(side, high[0], high[1]);
  const steps = Math.floor(((PLACES - Number(west < 0)) * side) / (east - west));
  if (steps < MIN_STEPS) return null;
  const step = side / steps;
  west = west < 0 ? -Math.ceil(-west / step) * step : 0;
  return {
    origin: [west, west, low[2]], step: [step, step, (high[2] - low[2]) / PLACES],
    log_scale: [clip(least), (clip(largest) - clip(least)) / SIZES], sh_degree: 0,
  };
}

/**
 * Write Gaussians' records to the beginning of a buffer, and return that.
 *
 * @param {ArrayBuffer} buffer @param {Gaussians} gaussians @param {Encoding} encoding
 */
export function writeRecords(buffer, { count, centres, logScales, turns, paint }, encoding) {
  const { origin, step, log_scale: [least, rise] } = encoding;
  const halves = new Uint16Array(buffer, 0, (count * RECORD) / 2), bytes = new Uint8Array(buffer, 0, count * RECORD);
  /** @param {number} v @param {number} most */
  const quantize = (v, most) => Math.min(Math.max(roundEven(v), 0), most);
  for (let k = 0; k < count; k++) {
    const { turn, axes } = leastTurn([...turns.subarray(4 * k, 4 * k + 4)]), at = RECORD * k;
    for (let n = 0; n < 3; n++) {
      halves[8 * k + n] = quantize((centres[3 * k + n] - origin[n]) / (step[n] || 1), PLACES);
      bytes[at + 6 + n] = quantize((logScales[3 * k + axes[n]] - least) / (rise || 1), SIZES);
      const steps = roundEven((turn[n + 1] * TURN_STEPS) / MAX_TURN);
      bytes[at + 9 + n] = TURN_STEPS + Math.min(Math.max(steps, -TURN_STEPS), TURN_STEPS);
    }
    bytes.set(paint.subarray(4 * k, 4 * k + 4), at + 12);
  }
  return buffer;
}

/** Round; halves to the even number. @param {number} v */
function roundEven(v) {
  const down = Math.floor(v);
  return v - down === 0.5 ? down + (down & 1) : Math.round(v);
}

/**
 * The unit quaternion (w > 0) of the smallest rotation that gives the same ellipsoid, and which old axis each new one is.
 *
 * @param {number[]} q
 */
function leastTurn(q) {
  const long = Math.hypot(...q);
  let best = CUBE[0], most = -1;
  for (const one of CUBE) {
    const [w, x, y, z] = one.turn, real = Math.abs(q[0] * w - q[1] * x - q[2] * y - q[3] * z) / long;
    if (real > most + 1e-12) [best, most] = [one, real];
  }
  const turn = multiply(q, best.turn), sign = (turn[0] < 0 ? -1 : 1) / long;
  return { turn: turn.map((v) => sign * v), axes: best.axes };
}

/** Product of quaternions. @param {number[]} p @param {number[]} q */
function multiply([a, b, c, d], [e, f, g, h]) {
  return [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
}

/** The 24 rotations of a cube: all products of a quarter turn about each of two axes. */
const CUBE = (() => {
  const quarter = Math.SQRT1_2, steps = [[quarter, quarter, 0, 0], [quarter, 0, quarter, 0]];
  const rotations = [[1, 0, 0, 0]];
  /** @param {number[]} q */
  const isKnown = (q) => rotations.some((p) => Math.abs(p.reduce((sum, v, n) => sum + v * q[n], 0)) > 0.99);
  for (const one of rotations) { // grows while it is walked through
    for (const step of steps) if (!isKnown(multiply(one, step))) rotations.push(multiply(one, step));
  }
  return rotations.map((turn) => ({ turn, axes: [0, 1, 2].map((axis) => rotatedAxis(turn, axis)) }));
})();

/** The axis to which a rotation of the cube brings one of the three. @param {number[]} turn @param {number} axis */
function rotatedAxis(turn, axis) {
  const [w, x, y, z] = turn, unit = [0, 0, 0, 0];
  unit[axis + 1] = 1;
  const [, ...to] = multiply(multiply(turn, unit), [w, -x, -y, -z]).map(Math.abs);
  return to.indexOf(Math.max(...to));
}

/**
 * @typedef {Gaussians & { tile: number, level: number }} GaussianSet
 * @typedef {import("./manifest.js").Manifest} Manifest
 * @typedef {{ scale: number, count: number, colour: number[] }} LevelSum
 */

const SIDE = 4; // of its tiles
const MAX_SPLATS = 8_388_608; // of a set, as the public renderer has it
const MAX_FILE = 2 ** 28; // bytes of a PLY file
const FOCAL = 960 / Math.tan(Math.PI / 6); // of the picture that level distances are made for
const BAND = 0.1, FLOOR_PIXELS = 12;
const AZIMUTHS = 16, DOWN = (20 * Math.PI) / 180;
const FILE = /(?:^|\/)(?!\._)[^/]*lod(\d{1,3})_tile_(\d{1,4})[^/]*\.ply$/;
const SH_C0 = 0.28209479177387814; // the constant spherical harmonic
const PROPERTIES = ["x", "y", "z", "opacity", "f_dc_0", "f_dc_1", "f_dc_2", "scale_0", "scale_1", "scale_2",
  "rot_0", "rot_1", "rot_2", "rot_3"];
const END = "end_header\n", HEADER_BYTES = 16384; // at most
const FARTHEST = 1e6, MAX_LOG = 12; // of coordinates; of logarithms of deviations
const SKY = { zenith: [0.36, 0.55, 0.8], horizon: [0.78, 0.84, 0.88] };

/** @param {import("./source.js").Files} files */
export const isGswt = (files) => [...files.keys()].some((name) => FILE.test(name));

/**
 * A bundle's source made of the PLY files. Throws a PageError: one of them is missing or broken.
 *
 * @param {import("./source.js").Files} files
 */
export async function gswtSource(files) {
  /** @type {import("./source.js").Files} */
  const made = new Map();
  const { sets, levels, tiles } = await readSets(files);
  sets.sort((a, b) => b.level - a.level || a.tile - b.tile); // as they are to be read
  const manifest = makeManifest(sets, levels, tiles);
  sets.forEach((set, k) => {
    const { file, size } = manifest.parts[k];
    made.set(file, { size, open: async () => writeRecords(new ArrayBuffer(size), set, manifest.encoding) });
  });
  const text = new TextEncoder().encode(JSON.stringify(manifest)).buffer;
  made.set(NAME, { size: text.byteLength, open: async () => text });
  return fileSource(made);
}

/** @param {import("./source.js").Files} files */
async function readSets(files) {
  const byKey = new Map();
  let levels = 0, tiles = 0;
  for (const [name, entry] of files) {
    const match = FILE.exec(name);
    if (!match) continue;
    const level = Number(match[1]), tile = Number(match[2]);
    byKey.set(`${level}/${tile}`, { name, ...entry });
    [levels, tiles] = [Math.max(levels, level + 1), Math.max(tiles, tile + 1)];
  }
  if (tiles % 16) throw new PageError(`The set has ${tiles} tiles, a multiple of 16 is needed. ${REMAKE_SET}`);
  if (tiles > MAX_TILES) throw new PageError(`The set has ${tiles} tiles, this page shows ${MAX_TILES}. ${REMAKE_SET}`);
  if (levels > MAX_LEVELS) {
    throw new PageError(`The set has ${levels} levels, this page shows ${MAX_LEVELS}. Leave the coarsest ones out.`);
  }
  /** @type {GaussianSet[]} */
  const sets = [];
  let splats = 0;
  for (let tile = 0; tile < tiles; tile++) {
    for (let level = 0; level < levels; level++) {
      const file = byKey.get(`${level}/${tile}`);
      if (!file) throw new PageError(`Tile ${tile} of level ${level} is missing in the set. ${REMAKE_SET}`);
      if (file.size > MAX_FILE) throw tooLarge(file.name);
      sets.push({ tile, level, ...parsePly(await file.open(), file.name) });
      splats += sets[sets.length - 1].count;
      if (splats > MAX_SPLATS) throw new PageError(`The set has more than ${MAX_SPLATS} splats. Make a smaller one.`);
    }
  }
  return { sets, levels, tiles };
}

/**
 * The manifest of a set. Throws a PageError: it spreads too far.
 *
 * @param {GaussianSet[]} sets @param {number} levels @param {number} tiles
 * @returns {Manifest}
 */
function makeManifest(sets, levels, tiles) {
  const directions = orderDirections(), orders = directions.map((_, k) => k);
  const sums = Array.from({ length: levels }, () => ({ scale: 0, count: 0, colour: [0, 0, 0] }));
  /** @type {import("./manifest.js").TileEntry[]} */
  const entries = Array.from({ length: tiles }, (_, tile) => (
    { tile, uncertainty: 0, z: [Infinity, -Infinity], orders, chunks: [] }));
  const parts = sets.map((set, part) => {
    const { tile, level, count } = set, { z, chunks } = entries[tile];
    addToSums(set, sums[level], z);
    chunks.push({ level, count, part, first: 0 });
    return { kind: "plain", file: `parts/lod${level}_tile_${tile}.bin`, bytes: RECORD * count, size: RECORD * count };
  });
  const scales = sums.map(({ scale, count }) => scale / Math.max(1, count)), last = sums[levels - 1];
  const spacing = SIDE / Math.sqrt(sums[0].count / tiles), v = Math.atan((9 / 16) * Math.tan(Math.PI / 6));
  const encoding = fitEncoding(sets, SIDE, spacing / FLOOR_PIXELS);
  if (!encoding) throw new PageError(`A splat lies dozens of tile sides from the others. ${REMAKE_SET}`);
  const colour = last.colour.map((sum) => Math.min(Math.max(sum / Math.max(1, last.count), 0), 1));
  return {
    format: "davgswt", version: VERSION, unit: "unit", tile_side: SIDE, salt: 0, sky: SKY, encoding, directions,
    tiles: entries, parts, materials: [{ name: "ground", share: 1, first_tile: 0, ground_colour: colour }],
    eye_floor: (((spacing * FOCAL) / FLOOR_PIXELS) * Math.sin(Math.PI / 6 + v)) / Math.cos(v),
    ground_colour: colour,
    levels: scales.map((scale, level) => {
      const distance = level < levels - 1 ? scales[level + 1] * FOCAL : null;
      return { level, mean_scale: scale, distance, band: distance ? BAND * distance : 0 };
    }),
  };
}

/**
 * Add Gaussians to the sums of a level and widen the heights of a tile.
 *
 * @param {GaussianSet} set @param {LevelSum} sum @param {number[]} z
 */
function addToSums({ count, centres, logScales, paint }, sum, z) {
  for (let k = 0; k < count; k++) {
    const scales = [0, 1, 2].map((n) => Math.exp(logScales[3 * k + n])), reach = 3 * Math.max(...scales);
    z[0] = Math.min(z[0], centres[3 * k + 2] - reach);
    z[1] = Math.max(z[1], centres[3 * k + 2] + reach);
    sum.scale += (scales[0] + scales[1] + scales[2]) / 3;
    for (let n = 0; n < 3; n++) sum.colour[n] += paint[4 * k + n] / 255;
  }
  sum.count += count;
}

/** A ring of directions 20 degrees below the horizon, and straight down. */
function orderDirections() {
  const around = Array.from({ length: AZIMUTHS }, (_, k) => (2 * Math.PI * k) / AZIMUTHS);
  const ring = around.map((a) => [Math.cos(a) * Math.cos(DOWN), Math.sin(a) * Math.cos(DOWN), -Math.sin(DOWN)]);
  return [...ring, [0, 0, -1]];
}

/**
 * The Gaussians of a PLY file. Throws a PageError: the file is no such PLY, or a value is not finite.
 *
 * @param {ArrayBuffer} buffer @param {string} name
 * @returns {Gaussians}
 */
function parsePly(buffer, name) {
  const { count, at, step, offsets } = parseHeader(buffer, name), view = new DataView(buffer);
  const centres = new Float32Array(3 * count), logScales = new Float32Array(3 * count);
  const turns = new Float32Array(4 * count), paint = new Uint8ClampedArray(4 * count);
  const row = new Float64Array(PROPERTIES.length);
  for (let k = 0; k < count; k++) {
    for (let n = 0; n < offsets.length; n++) row[n] = view.getFloat32(at + step * k + offsets[n], true);
    if (!row.every(Number.isFinite)) {
      throw new PageError(`${name}: splat ${k} has a value that is not finite. ${REMAKE_SET}`);
    }
    if (Math.hypot(row[0], row[1], row[2]) > FARTHEST || Math.max(row[7], row[8], row[9]) > MAX_LOG) {
      throw new PageError(`${name}: splat ${k} is too far away or too large. ${REMAKE_SET}`);
    }
    centres.set(row.subarray(0, 3), 3 * k);
    for (let n = 0; n < 3; n++) paint[4 * k + n] = 255 * (0.5 + SH_C0 * row[4 + n]);
    paint[4 * k + 3] = 255 / (1 + Math.exp(-row[3]));
    logScales.set(row.subarray(7, 10), 3 * k);
    turns.set(Math.hypot(...row.subarray(10)) > 0 ? row.subarray(10) : [1, 0, 0, 0], 4 * k);
  }
  return { count, centres, logScales, turns, paint };
}

/**
 * Where a file's vertices begin, how many bytes each has and at which offsets the properties are.
 *
 * @param {ArrayBuffer} buffer @param {string} name
 */
function parseHeader(buffer, name) {
  /** @param {string} what */
  const broken = (what) => new PageError(`${name} cannot be read: ${what}. ${REMAKE_SET}`);
  const head = new Uint8Array(buffer, 0, Math.min(buffer.byteLength, HEADER_BYTES));
  const text = new TextDecoder("latin1").decode(head), end = text.indexOf(END);
  if (!text.startsWith("ply\n") || end < 0) throw broken("it has no PLY header");
  const lines = text.slice(0, end).split("\n");
  if (!lines.includes("format binary_little_endian 1.0")) throw broken("it is not in binary_little_endian 1.0");
  const count = Number(lines.find((line) => line.startsWith("element vertex "))?.split(" ")[2]);
  const properties = lines.filter((line) => line.startsWith("property ")).map((line) => line.split(" "));
  if (!Number.isInteger(count) || count < 1) throw broken("it has no splats");
  if (properties.some(([, type]) => type !== "float")) throw broken("a property is no float");
  const names = properties.map(([, , property]) => property);
  const missing = PROPERTIES.find((property) => !names.includes(property));
  if (missing) throw broken(`the property ${missing} is missing`);
  const at = end + END.length, step = 4 * properties.length;
  if (buffer.byteLength !== at + step * count) throw broken("it is cut short or too long");
  return { count, at, step, offsets: PROPERTIES.map((property) => 4 * names.lastIndexOf(property)) };
}
