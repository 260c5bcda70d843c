// The backdrop: sky, with a sun where the manifest has one, and a far ground of the terrain's mean colour. The same
// colours as dav_gswt/terrain/backdrop.py.

import { createProgram, setAxes } from "./gl.js";
import { GLOW, setLight } from "./lighting.js";
import { backdropCode } from "./shaders.js";

/**
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {ReturnType<typeof createSky>} Sky
 */

const VERTEX = `#version 300 es
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(at, 0.0, 1.0);
}`;

/** @param {import("../terrain/heights.js").HeightField["kind"]} kind @param {boolean} [lit] below a sun that moves? */
const fragmentShader = (kind, lit = false) => `#version 300 es
precision highp float;
in vec2 at;
out vec4 colour;
uniform vec3 right, up, ahead, sun, sunColour; // sun: its direction; of length 0: none
uniform vec2 halfTangent; // tangents of half the field of view
${backdropCode(kind, lit)}
void main() {
  vec3 ray = normalize(ahead + at.x * halfTangent.x * right + at.y * halfTangent.y * up);
  vec3 seen = backdrop(${kind === "sphere" ? "ray" : "ray.z"});
  float close = dot(ray, sun);${lit ? GLOW : ""}
  float disc = ${kind === "sphere" ? "dot(ray, upward) + dip" : "ray.z"} > 0.0 ? smoothstep(0.99988, 0.99996, close) + 0.25 * pow(max(close, 0.0), 350.0) : 0.0;
  colour = vec4(mix(seen, sunColour, clamp(disc, 0.0, 1.0)), 1.0);
}`;

/** @param {import("./gl.js").GL} gl @param {import("../data/manifest.js").Manifest} manifest */
export function createSky(gl, manifest) {
  const { sky, heights } = manifest, kind = heights?.kind ?? "flat", empty = gl.createVertexArray();
  const sphere = heights?.kind === "sphere" ? heights : null;
  const plain = createProgram(gl, VERTEX, fragmentShader(kind));
  const sunny = manifest.light && !sphere ? createProgram(gl, VERTEX, fragmentShader(kind, true)) : plain;
  const long = sky.sun ? Math.hypot(...sky.sun.direction) : 1;
  const own = sky.sun?.direction.map((v) => v / long) ?? [0, 0, 0];
  return {
    /**
     * Fill the picture; low: sine of the angle below the horizon at which tiles end.
     *
     * @param {Camera} camera @param {Pick<import("./splats.js").DrawOptions, "low" | "light">} options
     */
    draw(camera, { low, light }) {
      const { use, uniforms } = light ? sunny : plain;
      use();
      gl.bindVertexArray(empty);
      gl.disable(gl.BLEND);
      setAxes(gl, uniforms, camera);
      setLight(gl, uniforms, manifest, light);
      gl.uniform3fv(uniforms.sun, light?.sun.direction ?? own);
      gl.uniform3fv(uniforms.sunColour, light?.sunColour ?? sky.sun?.colour ?? [1, 1, 1]);
      gl.uniform2f(uniforms.halfTangent, camera.width / 2 / camera.focal, camera.height / 2 / camera.focal);
      gl.uniform1f(uniforms.low, low);
      if (sphere) setHorizon(gl, uniforms, sphere, camera.eye);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.bindVertexArray(null);
    },
  };
}

/**
 * Set what the backdrop of an eye over a sphere needs.
 *
 * @param {import("./gl.js").GL} gl @param {Record<string, WebGLUniformLocation | null>} uniforms
 * @param {{ radius: number }} sphere
 * @param {number[]} eye from the planet's middle
 */
export function setHorizon(gl, uniforms, { radius }, eye) {
  const far = Math.hypot(...eye), height = Math.max(far - radius, 0);
  gl.uniform3fv(uniforms.upward, eye.map((v) => v / far));
  gl.uniform1f(uniforms.dip, Math.sqrt(height * (2 * radius + height)) / far);
  gl.uniform1f(uniforms.height, height / radius);
}
