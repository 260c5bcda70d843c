// Gaussians in 16 bytes: one texel of four 32-bit words. bundle/encoding.py is the other end.

export const RECORD = 16; // bytes
const WIDE = 65536; // from so many Gaussians on an index takes four bytes

/** How indices of an order are stored. */
export const indexType = (count) => (count < WIDE ? Uint16Array : Uint32Array);

/** Bytes of a chunk. */
export const sizeOf = (count, orders) => count * (RECORD + orders * indexType(count).BYTES_PER_ELEMENT);

/** Can a manifest's encoding be used? */
export function sound(encoding) {
  const numbers = (list, size) => Array.isArray(list) && list.length === size && list.every(Number.isFinite);
  return numbers(encoding?.origin, 3) && numbers(encoding.step, 3) && numbers(encoding.log_scale, 2)
    && encoding.sh_degree === 0;
}

/** Tell a program that holds DECODED how the bundle's Gaussians were rounded. */
export function setEncoding(gl, uniforms, { origin, step, log_scale: logScale }) {
  gl.uniform3fv(uniforms.origin, origin);
  gl.uniform3fv(uniforms.stride, step);
  gl.uniform2fv(uniforms.logScale, logScale);
}

/** For a vertex shader: a record as a Gaussian. Of the turn's quaternion w x y z the first is the largest. */
export const DECODED = `
uniform vec3 origin, stride; // position = origin + stride * 16 bits
uniform vec2 logScale;       // ln(deviation) = x + y * 8 bits
struct Gaussian { vec3 position; vec3 deviation; vec4 turn; vec4 paint; };

Gaussian decoded(uvec4 t) {
  vec3 place = vec3(t.x & 65535u, t.x >> 16, t.y & 65535u);
  vec3 size = vec3(t.y >> 16 & 255u, t.y >> 24, t.z & 255u);
  vec3 turn = (vec3(t.z >> 8 & 255u, t.z >> 16 & 255u, t.z >> 24) - 127.0) * ${Math.sin(Math.PI / 8) / 127};
  vec4 paint = vec4(t.w & 255u, t.w >> 8 & 255u, t.w >> 16 & 255u, t.w >> 24) / 255.0;
  float whole = sqrt(max(1.0 - dot(turn, turn), 0.0));
  return Gaussian(origin + stride * place, exp(logScale.x + logScale.y * size), vec4(whole, turn), paint);
}`;
