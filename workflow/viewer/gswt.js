// A gswt.zip: tiles as PLY files for the public GSWT renderer. It holds no orders, distances or surface, so these are
// worked out here as the pipeline does for a bundle (dav_gswt/bundle/level_distances.py, orders.py), but for one number of
// directions: what they cost is not measured.

import { NAME } from "./bundle.js";
import { createSorter } from "./order.js";
import { indexType, RECORD, sizeOf, VERSION } from "./records.js";
import { encodingOf, writeRecords } from "./rounding.js";
import { LEVELS } from "./runs.js";
import { fromFiles, PageError } from "./source.js";

const SIDE = 4; // how wide its tiles are
const FOCAL = 960 / Math.tan(Math.PI / 6); // of the picture that level distances are made for
const BAND = 0.1, FLOOR_PIXELS = 12, DC = 0.28209479177387814;
const AZIMUTHS = 16, DOWN = (20 * Math.PI) / 180;
const FILE = /(?:^|\/)(?!\._)[^/]*lod(\d{1,3})_tile_(\d{1,4})[^/]*\.ply$/;
const NEEDED = ["x", "y", "z", "opacity", "f_dc_0", "f_dc_1", "f_dc_2", "scale_0", "scale_1", "scale_2",
  "rot_0", "rot_1", "rot_2", "rot_3"];
const SKY = { zenith: [0.36, 0.55, 0.8], horizon: [0.78, 0.84, 0.88] };

export const isGswt = (files) => [...files.keys()].some((name) => FILE.test(name));

/** A bundle's source made of the PLY files. Raises: PageError: one of them is missing or broken. */
export async function gswtSource(files) {
  const found = new Map();
  for (const [name, open] of files) {
    const match = FILE.exec(name);
    if (match) found.set(`${Number(match[1])}/${Number(match[2])}`, { name, open });
  }
  const most = (n) => 1 + Math.max(...[...found.keys()].map((key) => Number(key.split("/")[n])));
  const levels = most(0), tiles = most(1);
  if (tiles % 16) throw new PageError(`The set has ${tiles} tiles, a multiple of 16 is needed. Make it again.`);
  if (levels > LEVELS) {
    throw new PageError(`The set has ${levels} levels, this page shows ${LEVELS}. Leave the coarsest ones out.`);
  }
  const sets = [];
  for (let tile = 0; tile < tiles; tile++) {
    for (let level = 0; level < levels; level++) {
      const entry = found.get(`${level}/${tile}`);
      if (!entry) throw new PageError(`Tile ${tile} of level ${level} is missing in the set. Make it again.`);
      sets.push({ tile, level, ...gaussiansOf(await entry.open(), entry.name) });
    }
  }
  const manifest = described(sets, levels, tiles), chunks = new Map();
  for (const set of sets) chunks.set(fileOf(set), async () => chunkOf(set, manifest));
  chunks.set(NAME, async () => new TextEncoder().encode(JSON.stringify(manifest)).buffer);
  return fromFiles(chunks);
}

const fileOf = ({ tile, level }) => `lod${level}_tile_${tile}.bin`;

/** The manifest of a set. Raises: PageError: it spreads too far. */
function described(sets, levels, tiles) {
  const directions = directionsOf(), orders = directions.map((_, k) => k);
  const sums = Array.from({ length: levels }, () => ({ scale: 0, count: 0, colour: [0, 0, 0] }));
  const listed = Array.from({ length: tiles }, (_, tile) => (
    { tile, uncertainty: 0, z: [Infinity, -Infinity], chunks: [] }));
  for (const set of sets) {
    const { tile, level, count } = set, { z, chunks } = listed[tile];
    summed(set, sums[level], z);
    chunks.push({ level, file: fileOf(set), bytes: sizeOf(count, orders.length), count, orders });
  }
  const scales = sums.map(({ scale, count }) => scale / Math.max(1, count)), last = sums[levels - 1];
  const spacing = SIDE / Math.sqrt(sums[0].count / tiles), v = Math.atan((9 / 16) * Math.tan(Math.PI / 6));
  const encoding = encodingOf(sets, SIDE, spacing / FLOOR_PIXELS);
  if (!encoding) throw new PageError("A splat lies dozens of tile sides from the others. Make the set again.");
  return {
    format: "davgswt", version: VERSION, unit: "unit", tile_side: SIDE, salt: 0, sky: SKY, encoding, directions,
    tiles: listed,
    eye_floor: (((spacing * FOCAL) / FLOOR_PIXELS) * Math.sin(Math.PI / 6 + v)) / Math.cos(v),
    ground_colour: last.colour.map((sum) => Math.min(Math.max(sum / Math.max(1, last.count), 0), 1)),
    levels: scales.map((scale, level) => {
      const distance = level < levels - 1 ? scales[level + 1] * FOCAL : null;
      return { level, mean_scale: scale, distance, band: distance ? BAND * distance : 0 };
    }),
  };
}

/** Add Gaussians to a level's sums and widen a tile's heights. */
function summed({ count, centres, logScales, paint }, sum, z) {
  for (let k = 0; k < count; k++) {
    const scales = [0, 1, 2].map((n) => Math.exp(logScales[3 * k + n])), reach = 3 * Math.max(...scales);
    z[0] = Math.min(z[0], centres[3 * k + 2] - reach);
    z[1] = Math.max(z[1], centres[3 * k + 2] + reach);
    sum.scale += (scales[0] + scales[1] + scales[2]) / 3;
    for (let n = 0; n < 3; n++) sum.colour[n] += paint[4 * k + n] / 255;
  }
  sum.count += count;
}

/** A ring of a bundle's, 20 degrees down, and straight down. */
function directionsOf() {
  const around = Array.from({ length: AZIMUTHS }, (_, k) => (2 * Math.PI * k) / AZIMUTHS);
  const ring = around.map((a) => [Math.cos(a) * Math.cos(DOWN), Math.sin(a) * Math.cos(DOWN), -Math.sin(DOWN)]);
  return [...ring, [0, 0, -1]];
}

const sorted = createSorter();

/** The bytes of a chunk. */
function chunkOf(set, { encoding, directions }) {
  const { count, centres } = set, out = new ArrayBuffer(sizeOf(count, directions.length));
  writeRecords(out, set, encoding);
  const orders = new (indexType(count))(out, count * RECORD), depths = new Float32Array(count);
  directions.forEach(([x, y, z], d) => {
    for (let k = 0; k < count; k++) depths[k] = centres[3 * k] * x + centres[3 * k + 1] * y + centres[3 * k + 2] * z;
    orders.set(sorted(depths, count), d * count);
  });
  return out;
}

/** The Gaussians of a PLY file, as rounding.js takes them. Raises: PageError: a value is not finite. */
function gaussiansOf(buffer, name) {
  const { count, at, step, places } = headOf(buffer, name), view = new DataView(buffer);
  const centres = new Float32Array(3 * count), logScales = new Float32Array(3 * count);
  const turns = new Float32Array(4 * count), paint = new Uint8ClampedArray(4 * count);
  const row = new Float64Array(NEEDED.length), where = NEEDED.map((property) => places[property]);
  for (let k = 0; k < count; k++) {
    for (let n = 0; n < where.length; n++) row[n] = view.getFloat32(at + step * k + where[n], true);
    if (!row.every(Number.isFinite)) {
      throw new PageError(`${name}: splat ${k} has a value that is not finite. Make the set again.`);
    }
    centres.set(row.subarray(0, 3), 3 * k);
    for (let n = 0; n < 3; n++) paint[4 * k + n] = 255 * (0.5 + DC * row[4 + n]);
    paint[4 * k + 3] = 255 / (1 + Math.exp(-row[3]));
    logScales.set(row.subarray(7, 10), 3 * k);
    turns.set(Math.hypot(...row.subarray(10)) > 0 ? row.subarray(10) : [1, 0, 0, 0], 4 * k);
  }
  return { count, centres, logScales, turns, paint };
}

/** Where a PLY file's splats begin, how many bytes each has and where its properties are. */
function headOf(buffer, name) {
  const broken = (what) => new PageError(`${name} cannot be read: ${what}. Make the set again.`);
  const text = new TextDecoder("latin1").decode(new Uint8Array(buffer, 0, Math.min(buffer.byteLength, 16384)));
  const end = text.indexOf("end_header\n");
  if (!text.startsWith("ply\n") || end < 0) throw broken("it has no PLY header");
  const lines = text.slice(0, end).split("\n");
  if (!lines.includes("format binary_little_endian 1.0")) throw broken("it is not in binary_little_endian 1.0");
  const count = Number(lines.find((line) => line.startsWith("element vertex "))?.split(" ")[2]);
  const properties = lines.filter((line) => line.startsWith("property ")).map((line) => line.split(" "));
  if (!Number.isInteger(count) || count < 1) throw broken("it has no splats");
  if (properties.some(([, type]) => type !== "float")) throw broken("a property is no float");
  const places = Object.fromEntries(properties.map(([, , property], k) => [property, 4 * k]));
  const missing = NEEDED.find((property) => !(property in places));
  if (missing) throw broken(`the property ${missing} is missing`);
  const at = end + "end_header\n".length, step = 4 * properties.length;
  if (buffer.byteLength !== at + step * count) throw broken("it is cut short or too long");
  return { count, at, step, places };
}
