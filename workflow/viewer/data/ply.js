// Gaussians from PLY files in the layout of 3D Gaussian splatting.

import { PageError, REMAKE_SET } from "./errors.js";

const SH_C0 = 0.28209479177387814; // the constant spherical harmonic
const PROPERTIES = ["x", "y", "z", "opacity", "f_dc_0", "f_dc_1", "f_dc_2", "scale_0", "scale_1", "scale_2",
  "rot_0", "rot_1", "rot_2", "rot_3"];
const END = "end_header\n", HEADER_BYTES = 16384; // at most
const FARTHEST = 1e6, MAX_LOG = 12; // of coordinates; of logarithms of deviations

/**
 * The Gaussians of a PLY file. Throws a PageError: the file is no such PLY, or a value is not finite.
 *
 * @param {ArrayBuffer} buffer
 * @param {string} name
 * @returns {import("./quantize.js").Gaussians}
 */
export function parsePly(buffer, name) {
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
 * @param {ArrayBuffer} buffer
 * @param {string} name
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
