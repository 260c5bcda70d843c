// Gaussians on the GPU. A chunk's bytes go up as they are: 16-byte records into an integer texture (a texel each), the
// orders into one buffer; a draw call takes one tile in one order, each instance one Gaussian.

import { DECODED, setEncoding } from "./encoding.js";
import { program } from "./gl.js";

const TEXELS = 2048; // width of a record texture

const VERTEX = `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
layout(location = 0) in uint index;
uniform usampler2D records;
uniform vec3 right, up, ahead;  // camera axes in the world
uniform vec3 offset;            // the tile's south-west corner, seen from the eye
uniform vec2 halfSize;          // half the picture, in pixels
uniform vec2 fade;              // distances between which the last tiles give way to the far ground
uniform float focal, near;
out vec2 at;                    // in standard deviations from the centre
out vec4 colour;

const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

${DECODED}

mat3 rotation(vec4 q) { // w x y z, of length 1
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
    2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
    2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

void main() {
  gl_Position = NOWHERE;
  at = vec2(0.0);
  colour = vec4(0.0);
  ivec2 texel = ivec2(int(index & ${TEXELS - 1}u), int(index >> ${Math.log2(TEXELS)}u));
  Gaussian gaussian = decoded(texelFetch(records, texel, 0));
  vec3 seen = gaussian.position + offset;
  vec3 p = vec3(dot(right, seen), dot(up, seen), dot(ahead, seen));
  if (!(p.z > near)) return;
  float opacity = gaussian.paint.a * (1.0 - smoothstep(fade.x, fade.y, length(seen)));
  if (opacity * 255.0 <= 1.0) return;

  // EWA: covariance J R S S^T R^T J^T of the picture, with a pixel's own width of 0.3 added. J is taken at a point
  // inside a somewhat wider picture, or splats at its edges would be drawn out to needles.
  mat3 axes = rotation(gaussian.turn);
  vec3 deviation = gaussian.deviation;
  mat3 turned = mat3(right, up, ahead);
  mat3 shape = transpose(turned) * mat3(axes[0] * deviation.x, axes[1] * deviation.y, axes[2] * deviation.z);
  vec2 slope = clamp(p.xy / p.z, -1.3 * halfSize / focal, 1.3 * halfSize / focal);
  vec3 depth = vec3(shape[0].z, shape[1].z, shape[2].z);
  vec3 across = (vec3(shape[0].x, shape[1].x, shape[2].x) - slope.x * depth) * (focal / p.z);
  vec3 along = (vec3(shape[0].y, shape[1].y, shape[2].y) - slope.y * depth) * (focal / p.z);
  // Where a splat is nearly as deep as it is far, a plane through its centre says nothing about its rim: discs underfoot
  // would be drawn up over the horizon as haze.
  opacity *= smoothstep(1.8, 3.2, p.z / max(length(depth), 1e-9));
  if (opacity * 255.0 <= 1.0) return;
  float a = dot(across, across) + 0.3, b = dot(across, along), c = dot(along, along) + 0.3;

  float mean = 0.5 * (a + c), lean = 0.5 * (a - c), spread = length(vec2(lean, b));
  vec2 major = lean > 0.0 ? vec2(lean + spread, b) : vec2(b, spread - lean);
  major = spread < 1e-6 * mean ? vec2(1.0, 0.0) : normalize(major);
  vec2 lengths = sqrt(vec2(mean + spread, max((a * c - b * b) / (mean + spread), 0.3)));
  float reach = sqrt(2.0 * log(255.0 * opacity)); // beyond it the Gaussian is fainter than 1/255
  at = (vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0) * reach;
  vec2 pixel = focal * p.xy / p.z + at.x * lengths.x * major + at.y * lengths.y * vec2(-major.y, major.x);
  colour = vec4(gaussian.paint.rgb, opacity);
  gl_Position = vec4(pixel / halfSize, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
in vec4 colour;
out vec4 painted;
void main() {
  float alpha = min(0.99, colour.a * exp(-0.5 * dot(at, at)));
  if (alpha < 1.0 / 255.0) discard;
  painted = vec4(colour.rgb * alpha, alpha);
}`;

export function createSplats(gl, encoding) {
  const { use, uniforms } = program(gl, VERTEX, FRAGMENT);
  const stored = new Map(); // "tile/level" -> on the GPU
  const instances = gl.createVertexArray();
  gl.bindVertexArray(instances);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribDivisor(0, 1);
  gl.bindVertexArray(null);

  return {
    /** Bring a chunk to the GPU. */
    add(chunk) {
      const orders = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, orders);
      gl.bufferData(gl.ARRAY_BUFFER, chunk.orders, gl.STATIC_DRAW);
      stored.set(`${chunk.tile}/${chunk.level}`, { texture: recordTexture(gl, chunk), orders, count: chunk.count,
        bytes: chunk.orders.BYTES_PER_ELEMENT });
    },

    /** Draw tiles, given back to front, over what the picture already shows. */
    draw(camera, tiles, { near, fade }) {
      use();
      setEncoding(gl, uniforms, encoding);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      for (const axis of ["right", "up", "ahead"]) gl.uniform3fv(uniforms[axis], camera[axis]);
      gl.uniform2f(uniforms.halfSize, camera.width / 2, camera.height / 2);
      gl.uniform2fv(uniforms.fade, fade);
      gl.uniform1f(uniforms.focal, camera.focal);
      gl.uniform1f(uniforms.near, near);
      gl.bindVertexArray(instances);
      for (const { tile, level, order, offset } of tiles) {
        const chunk = stored.get(`${tile}/${level}`);
        if (!chunk?.count) continue;
        gl.bindTexture(gl.TEXTURE_2D, chunk.texture);
        gl.bindBuffer(gl.ARRAY_BUFFER, chunk.orders);
        const type = chunk.bytes === 2 ? gl.UNSIGNED_SHORT : gl.UNSIGNED_INT;
        gl.vertexAttribIPointer(0, 1, type, chunk.bytes, chunk.bytes * chunk.count * order);
        gl.uniform3fv(uniforms.offset, offset);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, chunk.count);
      }
      gl.bindVertexArray(null);
    },
  };
}

/** The records of a chunk as they are, a texel of four 32-bit words a Gaussian. */
function recordTexture(gl, { records, count }) {
  const rows = Math.floor(count / TEXELS), rest = count % TEXELS;
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32UI, TEXELS, Math.max(1, rows + (rest > 0)));
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  const [format, type] = [gl.RGBA_INTEGER, gl.UNSIGNED_INT];
  if (rows) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, TEXELS, rows, format, type, records);
  if (rest) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows, rest, 1, format, type, records, rows * TEXELS * 4);
  return texture;
}
