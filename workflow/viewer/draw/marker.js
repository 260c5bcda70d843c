// A ring on the ground: where one would stand after a teleport.

import { createProgram, setAxes } from "./gl.js";

const PARTS = 48; // of the ring
const OUTER = 1, INNER = 0.72; // radii
const VERTEX = `#version 300 es
layout(location = 0) in vec3 seen; // from the eye
uniform vec3 right, up, ahead;
uniform vec2 halfSize;
uniform float focal;
void main() {
  float depth = dot(ahead, seen);
  gl_Position = vec4(vec2(dot(right, seen), dot(up, seen)) * focal / halfSize, 0.0, depth);
}`;
const FRAGMENT = `#version 300 es
precision mediump float;
out vec4 colour;
void main() { colour = vec4(0.89, 0.72, 0.47, 1.0) * 0.85; }`;

/** @param {import("./gl.js").GL} gl */
export function createMarker(gl) {
  const { use, uniforms } = createProgram(gl, VERTEX, FRAGMENT);
  const array = gl.createVertexArray(), buffer = gl.createBuffer(), points = new Float32Array(6 * (PARTS + 1));
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.bufferData(gl.ARRAY_BUFFER, points.byteLength, gl.DYNAMIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
  gl.bindVertexArray(null);
  return {
    /**
     * Draw the ring about a place.
     *
     * @param {import("../terrain/camera.js").Camera} camera
     * @param {number[]} place x and y
     * @param {number} radius
     * @param {(x: number, y: number) => number} ground its height
     */
    draw(camera, [x, y], radius, ground) {
      const [ex, ey, ez] = camera.eye;
      for (let k = 0; k <= PARTS; k++) {
        const turn = (2 * Math.PI * k) / PARTS;
        [INNER, OUTER].forEach((share, n) => {
          const px = x + share * radius * Math.cos(turn), py = y + share * radius * Math.sin(turn);
          points.set([px - ex, py - ey, ground(px, py) - ez], 6 * k + 3 * n);
        });
      }
      use();
      setAxes(gl, uniforms, camera);
      gl.uniform2f(uniforms.halfSize, camera.width / 2, camera.height / 2);
      gl.uniform1f(uniforms.focal, camera.focal);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, points);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 2 * (PARTS + 1));
      gl.bindVertexArray(null);
    },
    end() {
      gl.deleteVertexArray(array);
      gl.deleteBuffer(buffer);
    },
  };
}
