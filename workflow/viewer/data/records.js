// A chunk's bytes: one 16-byte record a Gaussian (a texel of four 32-bit words), then its orders. Written by
// dav_gswt/bundle/encoding.py, and by quantize.js for sets that the page converts; decoded by draw/shaders.js.

/**
 * How Gaussians were quantized: centre = origin + step * 16 bits; ln(deviation) = log_scale[0] + log_scale[1] * 8 bits.
 *
 * @typedef {{ origin: number[], step: number[], log_scale: number[], sh_degree: number }} Encoding
 */

export const VERSION = 3, OLDEST = 2; // of the manifest; version 2 does not name its only material
export const RECORD = 16; // bytes: position 3 x 16 bits; deviations, rotation 3 x 8 bits each; colour and opacity
export const WIDE = 65536; // from this number of Gaussians on, an index of an order takes four bytes
export const FARTHEST = 1e9; // of all lengths: single precision keeps their squares finite
const STEPS = 65535, MAX_LOG = 60; // of the grid; of the logarithm of a deviation
export const MAX_TURN = Math.sin(Math.PI / 8), TURN_STEPS = 127; // largest of a quaternion's x, y, z, and its steps

/**
 * Type of a chunk's orders.
 *
 * @param {number} count
 */
export const indexType = (count) => (count < WIDE ? Uint16Array : Uint32Array);

/**
 * Bytes of a chunk.
 *
 * @param {number} count
 * @param {number} orders
 */
export const chunkBytes = (count, orders) => count * (RECORD + orders * indexType(count).BYTES_PER_ELEMENT);

/**
 * Is this an encoding that can be decoded?
 *
 * @param {any} value
 * @returns {value is Encoding}
 */
export function isEncoding(value) {
  /** @param {unknown} list @param {number} size @param {number} most */
  const numbers = (list, size, most) => Array.isArray(list) && list.length === size
    && list.every((v) => Number.isFinite(v) && Math.abs(v) <= most);
  return numbers(value?.origin, 3, FARTHEST) && numbers(value.step, 3, FARTHEST / STEPS)
    && value.step.every((/** @type {number} */ v) => v >= 0)
    && numbers(value.log_scale, 2, MAX_LOG) && value.log_scale[1] >= 0 && value.sh_degree === 0;
}

/**
 * The standard deviation that a byte of a record stands for.
 *
 * @param {Encoding} encoding
 * @param {number} byte
 */
export const deviationOf = ({ log_scale: [least, rise] }, byte) => Math.exp(least + rise * byte);

/**
 * The parts of a chunk: records as words, all orders in one list, and of each Gaussian its centre and the byte of its
 * largest deviation.
 *
 * @param {ArrayBuffer} buffer
 * @param {number} count
 * @param {Encoding} encoding
 */
export function parseChunk(buffer, count, { origin, step }) {
  const records = new Uint32Array(buffer, 0, (count * RECORD) / 4);
  const orders = new (indexType(count))(buffer, count * RECORD);
  const centres = new Float32Array(3 * count), sizes = new Uint8Array(count);
  for (let k = 0; k < count; k++) {
    const first = records[4 * k], second = records[4 * k + 1];
    centres[3 * k] = origin[0] + step[0] * (first & 65535);
    centres[3 * k + 1] = origin[1] + step[1] * (first >>> 16);
    centres[3 * k + 2] = origin[2] + step[2] * (second & 65535);
    sizes[k] = Math.max((second >>> 16) & 255, second >>> 24, records[4 * k + 2] & 255);
  }
  return { records, orders, centres, sizes };
}
