// What lies behind the tiles: a sky without a sun, and below the horizon a far ground of the terrain's mean colour.

import { program } from "./gl.js";

const HAZE = 4; // the far ground pales from this many times the tiles' reach on: the tiles themselves stay clear

const VERTEX = `#version 300 es
out vec2 at;
void main() {
  at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;
  gl_Position = vec4(at, 0.0, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
out vec4 colour;
uniform vec3 right, up, ahead, zenith, horizon, ground;
uniform vec2 halfTangent; // tangents of half the field of view
uniform float pixel, far; // angle of a pixel; sine below the horizon at which haze begins
void main() {
  vec3 ray = ahead + at.x * halfTangent.x * right + at.y * halfTangent.y * up;
  float rise = ray.z / length(ray);
  vec3 above = mix(horizon, zenith, sqrt(clamp(rise, 0.0, 1.0)));
  vec3 below = mix(ground, horizon, 0.8 * exp(min(rise, 0.0) / far));
  colour = vec4(mix(below, above, clamp(rise / pixel + 0.5, 0.0, 1.0)), 1.0);
}`;

export function createSky(gl, manifest) {
  const { use, uniforms } = program(gl, VERTEX, FRAGMENT);
  const empty = gl.createVertexArray();
  return {
    /** Fill the picture; `reach` is how far tiles are drawn. */
    draw(camera, reach) {
      use();
      gl.bindVertexArray(empty);
      gl.disable(gl.BLEND);
      for (const axis of ["right", "up", "ahead"]) gl.uniform3fv(uniforms[axis], camera[axis]);
      gl.uniform3fv(uniforms.zenith, manifest.sky.zenith);
      gl.uniform3fv(uniforms.horizon, manifest.sky.horizon);
      gl.uniform3fv(uniforms.ground, manifest.ground_colour);
      gl.uniform2f(uniforms.halfTangent, camera.width / 2 / camera.focal, camera.height / 2 / camera.focal);
      gl.uniform1f(uniforms.pixel, 1 / camera.focal);
      gl.uniform1f(uniforms.far, camera.eye[2] / (HAZE * reach));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    },
  };
}
