// A gswt.zip: tiles as PLY files for the public GSWT renderer. It holds no orders, distances or surface, so these are worked
// out here as the pipeline does for a bundle (dav_gswt/bundle/lod.py, orders.py).

import { NAME } from "./bundle.js";
import { createSorter } from "./order.js";
import { ORDER, RECORD, VERSION } from "./records.js";
import { fromFiles, PageError } from "./source.js";

const SIDE = 4; // how wide its tiles are
const FOCAL = 960 / Math.tan(Math.PI / 6); // of the picture that level distances are made for
const BAND = 0.1, FLOOR_PIXELS = 12, DC = 0.28209479177387814;
const AZIMUTHS = 8, DOWN = (20 * Math.PI) / 180;
const FILE = /(^|\/)lod(\d)_tile_(\d\d)\.ply$/;
const NEEDED = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];
const SKY = { zenith: [0.36, 0.55, 0.8], horizon: [0.78, 0.84, 0.88] };

export const isGswt = (files) => [...files.keys()].some((name) => FILE.test(name));

/** A bundle's source made of the PLY files. Raises: PageError: one of them is missing or broken. */
export async function gswtSource(files) {
  const found = new Map();
  for (const [name, open] of files) {
    const match = FILE.exec(name);
    if (match) found.set(`${Number(match[2])}/${Number(match[3])}`, { name, open });
  }
  const levels = 1 + Math.max(...[...found.keys()].map((key) => Number(key.split("/")[0])));
  const tiles = 1 + Math.max(...[...found.keys()].map((key) => Number(key.split("/")[1])));
  if (tiles % 16) throw new PageError(`The set has ${tiles} tiles, a multiple of 16 is needed. Make it again.`);
  const chunks = new Map(), directions = directionsOf(), tables = [];
  const sums = Array.from({ length: levels }, () => ({ scale: 0, count: 0, colour: [0, 0, 0] }));
  for (let tile = 0; tile < tiles; tile++) {
    const table = { tile, uncertainty: 0, z: [Infinity, -Infinity], chunks: [] };
    for (let level = 0; level < levels; level++) {
      const entry = found.get(`${level}/${tile}`);
      if (!entry) throw new PageError(`Tile ${tile} of level ${level} is missing in the set. Make it again.`);
      const { buffer, count } = converted(await entry.open(), entry.name, directions, sums[level], table.z);
      const file = `lod${level}_tile_${tile}.bin`;
      chunks.set(file, async () => buffer.slice(0));
      table.chunks.push({ level, file, bytes: buffer.byteLength, count, orders: directions.map((_, k) => k) });
    }
    tables.push(table);
  }
  const scales = sums.map(({ scale, count }) => scale / Math.max(1, count)), last = sums[levels - 1];
  const spacing = SIDE / Math.sqrt(sums[0].count / tiles), v = Math.atan((9 / 16) * Math.tan(Math.PI / 6));
  const manifest = {
    format: "davgswt", version: VERSION, unit: "unit", tile_side: SIDE, salt: 0, sky: SKY, directions, tiles: tables,
    eye_floor: (((spacing * FOCAL) / FLOOR_PIXELS) * Math.sin(Math.PI / 6 + v)) / Math.cos(v),
    ground_colour: last.colour.map((sum) => Math.min(Math.max(sum / Math.max(1, last.count), 0), 1)),
    levels: scales.map((scale, level) => {
      const distance = level < levels - 1 ? scales[level + 1] * FOCAL : null;
      return { level, mean_scale: scale, distance, band: distance ? BAND * distance : 0 };
    }),
  };
  chunks.set(NAME, async () => new TextEncoder().encode(JSON.stringify(manifest)).buffer);
  return fromFiles(chunks);
}

/** Every second azimuth of a bundle's, 20 degrees down, and straight down. */
function directionsOf() {
  const around = Array.from({ length: AZIMUTHS }, (_, k) => (2 * Math.PI * k) / AZIMUTHS);
  return [...around.map((a) => [Math.cos(a) * Math.cos(DOWN), Math.sin(a) * Math.cos(DOWN), -Math.sin(DOWN)]), [0, 0, -1]];
}

const sorted = createSorter();

/** A chunk of a PLY file; adds to a level's sums and widens a tile's heights. */
function converted(buffer, name, directions, sum, z) {
  const { count, at, step, places } = headOf(buffer, name), view = new DataView(buffer);
  const out = new ArrayBuffer(count * (RECORD + ORDER * directions.length));
  const floats = new Float32Array(out, 0, count * (RECORD / 4)), bytes = new Uint8Array(out);
  for (let k = 0; k < count; k++) {
    const value = (property) => view.getFloat32(at + step * k + places[property], true);
    const row = (RECORD / 4) * k, byte = (bits, v) => (bytes[RECORD * k + bits] = Math.round(Math.min(Math.max(v, 0), 255)));
    const scales = [0, 1, 2].map((axis) => Math.exp(value(`scale_${axis}`)));
    ["x", "y", "z"].forEach((axis, n) => (floats[row + n] = value(axis)));
    scales.forEach((scale, n) => (floats[row + 3 + n] = scale));
    for (let n = 0; n < 3; n++) {
      const colour = 0.5 + DC * value(`f_dc_${n}`);
      byte(24 + n, 255 * colour);
      sum.colour[n] += colour;
    }
    byte(27, 255 / (1 + Math.exp(-value("opacity"))));
    const quat = [0, 1, 2, 3].map((n) => value(`rot_${n}`)), long = Math.hypot(...quat) || 1;
    quat.forEach((v, n) => byte(28 + n, 128 + (127 * v) / long));
    if (!Number.isFinite(floats[row] + floats[row + 1] + floats[row + 2] + scales[0] + scales[1] + scales[2])) {
      throw new PageError(`${name}: splat ${k} has a value that is not finite. Make the set again.`);
    }
    const reach = 3 * Math.max(...scales);
    z[0] = Math.min(z[0], floats[row + 2] - reach);
    z[1] = Math.max(z[1], floats[row + 2] + reach);
    sum.scale += (scales[0] + scales[1] + scales[2]) / 3;
  }
  sum.count += count;
  const orders = new (ORDER === 4 ? Uint32Array : Uint16Array)(out, count * RECORD), depths = new Float32Array(count);
  directions.forEach(([x, y, up], d) => {
    for (let k = 0, row = 0; k < count; k++, row += RECORD / 4) {
      depths[k] = floats[row] * x + floats[row + 1] * y + floats[row + 2] * up;
    }
    orders.set(sorted(depths, count), d * count);
  });
  return { buffer: out, count };
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
