// Far ground of planes that are not flat: rings of points about the eye on the surface, up to the horizon, drawn after
// the sky and before the splats. The same picture as dav_gswt/terrain/backdrop.py.

import { REACH } from "../terrain/cells.js";
import { createProgram, setAxes } from "./gl.js";
import { setLight } from "./lighting.js";
import { farSurface, roughBackdrop } from "./shaders.js";
import { hazeOf, RELIEF, setSurface, setUnder } from "./splats.js";

/**
 * @typedef {import("./gl.js").GL} GL
 * @typedef {import("../terrain/camera.js").Camera} Camera
 */

const RINGS = 64, AZIMUTHS = 288;
const NEAREST = 0.5, FARTHEST = 12.5; // radii of the first ring, over the distance of the last tiles, and of the last
const SINK = 0.005; // share of the distance by which rings lie below tiles, which would not hide all of them
const SECTORS = 48, WIDE = AZIMUTHS / SECTORS; // those in view are drawn, an instance each
// two rows of a sector are 14 vertices: software renderers remember the last 16

/** @param {"hills" | "image"} kind @param {boolean} lit below a sun that moves? */
const vertexShader = (kind, lit) => `#version 300 es
precision highp float;
precision highp int;
uniform vec3 right, up, ahead;
uniform vec2 lens;       // focal length over half the picture
uniform vec3 radii;      // of the first ring; logarithm of the ratio from ring to ring; of the last tiles
uniform float eyeHeight; // over the surface's zero
uniform int first;       // sector
out vec3 colour;
${roughBackdrop(lit)}
${farSurface(kind)}
void main() {
  int ring = gl_VertexID / ${WIDE + 1}, azimuth = ((first + gl_InstanceID) * ${WIDE} + gl_VertexID % ${WIDE + 1}) % ${AZIMUTHS};
  float radius = radii.x * exp(radii.y * float(ring)), turn = float(azimuth) * ${(2 * Math.PI) / AZIMUTHS};
  vec2 at = radius * vec2(cos(turn), sin(turn));
  vec3 rise = surface(at);
  vec3 seen = vec3(at, rise.x - eyeHeight);
  float distance = length(seen);
  colour = farColour(distance, shineOn(rise.yz, 1.0));
  seen.z -= ${SINK} * radius * clamp(5.0 - 5.0 * distance / radii.z, 0.0, 1.0);
  gl_Position = vec4(vec2(dot(right, seen), dot(up, seen)) * lens, 0.0, dot(ahead, seen));
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 colour;
out vec4 painted;
void main() {
  painted = vec4(colour, 1.0);
}`;

/** Far away first: there is no depth buffer. */
function sectorIndices() {
  const indices = [];
  for (let ring = RINGS - 2; ring >= 0; ring--) {
    for (let k = 0; k < WIDE; k++) {
      const a = ring * (WIDE + 1) + k, b = a + WIDE + 1;
      indices.push(a, a + 1, b, b, a + 1, b + 1);
    }
  }
  return new Uint16Array(indices);
}

/**
 * The sectors that a picture may show: the first, and how many.
 *
 * @param {Camera} camera
 */
export function sectorsInView({ ahead: [x, y], width, height, focal }) {
  const level = Math.hypot(x, y), wide = Math.hypot(width, height) / 2 / focal, lean = wide / Math.hypot(1, wide);
  if (lean >= level) return [0, SECTORS]; // the cone about the picture holds the zenith or the point below
  const half = Math.asin(lean / level), turn = SECTORS / (2 * Math.PI), middle = Math.atan2(y, x);
  const first = Math.floor((middle - half) * turn);
  return [((first % SECTORS) + SECTORS) % SECTORS, Math.min(SECTORS, Math.floor((middle + half) * turn) - first + 1)];
}

/**
 * @param {GL} gl @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 * @param {WebGLTexture | null} relief of a height map
 */
export function createFarGround(gl, manifest, heights, relief) {
  if (heights.kind === "flat" || heights.kind === "sphere") return null;
  const { tile_side: side, light: sun } = manifest, { kind } = heights;
  const [plain, sunny] = [false, sun !== undefined].map((lit) => {
    const program = createProgram(gl, vertexShader(kind, lit), FRAGMENT);
    program.use();
    setSurface(gl, program.uniforms, heights);
    return program;
  });
  const array = gl.createVertexArray(), indices = sectorIndices();
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
  gl.bindVertexArray(null);
  return {
    /** Draw over what is there. @param {Camera} camera @param {Pick<import("./splats.js").DrawOptions, "end" | "light">} options */
    draw(camera, { end, light }) {
      const { eye, width, height, focal } = camera, [first, count] = sectorsInView(camera);
      const nearest = NEAREST * end, farthest = FARTHEST * REACH * side;
      const { use, uniforms } = light ? sunny : plain;
      use();
      setAxes(gl, uniforms, camera);
      setLight(gl, uniforms, manifest, light);
      setUnder(gl, uniforms, heights, eye);
      gl.uniform1f(uniforms.haze, hazeOf(side));
      gl.uniform2f(uniforms.lens, (2 * focal) / width, (2 * focal) / height);
      gl.uniform3f(uniforms.radii, nearest, Math.log(farthest / nearest) / (RINGS - 1), end);
      gl.uniform1f(uniforms.eyeHeight, eye[2]);
      gl.uniform1i(uniforms.first, first);
      if (relief) {
        gl.activeTexture(gl.TEXTURE0 + RELIEF);
        gl.bindTexture(gl.TEXTURE_2D, relief);
        gl.activeTexture(gl.TEXTURE0);
      }
      gl.bindVertexArray(array);
      gl.disable(gl.BLEND);
      gl.drawElementsInstanced(gl.TRIANGLES, indices.length, gl.UNSIGNED_SHORT, 0, count);
      gl.bindVertexArray(null);
    },
  };
}
