// A Gaussian's bytes in a chunk: the only place that knows them, once for the worker and once for the GPU.

export const VERSION = 1; // of the manifest
export const RECORD = 32; // bytes of a Gaussian: 3 positions and 3 deviations (float32), colour, opacity, quaternion (bytes)
export const ORDER = 4; // bytes of an entry of an order
export const TEXELS = RECORD / 16; // of four 32-bit words

/** A chunk's parts: records as words, orders as one list, and of each Gaussian its centre. */
export function parts(buffer, { count }) {
  const records = new Uint32Array(buffer, 0, (count * RECORD) / 4);
  const orders = new (ORDER === 4 ? Uint32Array : Uint16Array)(buffer, count * RECORD);
  const floats = new Float32Array(buffer, 0, (count * RECORD) / 4), step = RECORD / 4;
  const centres = new Float32Array(3 * count);
  let largest = 0;
  for (let k = 0; k < count; k++) {
    const at = k * step;
    for (let axis = 0; axis < 3; axis++) {
      centres[3 * k + axis] = floats[at + axis];
      largest = Math.max(largest, floats[at + 3 + axis]);
    }
  }
  return { records, orders, centres, largest };
}

/** GLSL: the Gaussian at an index of the texture of all records. */
export const DECODE = `
struct Gaussian { vec3 centre, deviation; vec4 paint, turn; }; // turn: the quaternion w x y z, of any length
vec4 bytes(uint word) { return vec4(word & 255u, word >> 8 & 255u, word >> 16 & 255u, word >> 24); }
Gaussian decoded(uint index) {
  ivec2 texel = ivec2(int(index & 1023u) * 2, int(index >> 10u));
  uvec4 first = texelFetch(records, texel, 0), second = texelFetch(records, texel + ivec2(1, 0), 0);
  return Gaussian(uintBitsToFloat(first.xyz), uintBitsToFloat(uvec3(first.w, second.xy)),
    bytes(second.z) / 255.0, (bytes(second.w) - 128.0) / 127.0);
}`;
