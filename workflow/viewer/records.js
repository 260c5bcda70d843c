// A chunk's bytes: records of 16 a Gaussian, one texel of four 32-bit words, then its orders. The other end is
// dav_gswt/bundle/encoding.py; here are the worker's reading and the GPU's. rounding.js writes them.

export const VERSION = 2; // of the manifest
export const RECORD = 16; // bytes: position 3 x 16 bits; deviations, turn 3 x 8 bits each; colour and opacity
export const WIDE = 65536; // from so many Gaussians on an index of an order takes four bytes
export const STEEPEST = Math.sin(Math.PI / 8), TURNS = 127; // a turn's largest component beside w, and its steps

/** How a chunk's orders are stored. */
export const indexType = (count) => (count < WIDE ? Uint16Array : Uint32Array);

/** Bytes of a chunk. */
export const sizeOf = (count, orders) => count * (RECORD + orders * indexType(count).BYTES_PER_ELEMENT);

/** Can a manifest's encoding be used? */
export function isEncoding(told) {
  const numbers = (list, size) => Array.isArray(list) && list.length === size && list.every(Number.isFinite);
  return numbers(told?.origin, 3) && numbers(told.step, 3) && numbers(told.log_scale, 2) && told.sh_degree === 0;
}

/** The deviation that a byte of a record stands for, and the largest of a bundle's Gaussians. */
export const deviationOf = ({ log_scale: [least, rise] }, byte) => Math.exp(least + rise * byte);
export const largestOf = (encoding) => deviationOf(encoding, 255);

/** A chunk's parts: records as words, orders as one list, and of each Gaussian its centre and the largest deviation's byte. */
export function parts(buffer, count, { origin, step }) {
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

/** Tell a program that holds DECODE how a bundle's Gaussians were rounded. */
export function setEncoding(gl, uniforms, { origin, step, log_scale: logScale }) {
  gl.uniform3fv(uniforms.origin, origin);
  gl.uniform3fv(uniforms.stride, step);
  gl.uniform2fv(uniforms.logScale, logScale);
}

/** GLSL: a record as a Gaussian. */
export const DECODE = `
uniform vec3 origin, stride; // centre = origin + stride * 16 bits
uniform vec2 logScale;       // ln(deviation) = x + y * 8 bits
struct Gaussian { vec3 centre, deviation; vec4 paint, turn; }; // turn: the quaternion w x y z, of length 1
Gaussian decoded(uvec4 t) {
  vec3 place = vec3(t.x & 65535u, t.x >> 16, t.y & 65535u);
  vec3 size = vec3(t.y >> 16 & 255u, t.y >> 24, t.z & 255u);
  vec3 turn = (vec3(t.z >> 8 & 255u, t.z >> 16 & 255u, t.z >> 24) - 127.0) * ${STEEPEST / TURNS};
  vec4 paint = vec4(t.w & 255u, t.w >> 8 & 255u, t.w >> 16 & 255u, t.w >> 24) / 255.0;
  float whole = sqrt(max(1.0 - dot(turn, turn), 0.0));
  return Gaussian(origin + stride * place, exp(logScale.x + logScale.y * size), paint, vec4(whole, turn));
}`;
