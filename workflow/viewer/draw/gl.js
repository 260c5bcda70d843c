// WebGL2: context, programs, textures.

import { PageError } from "../data/checks.js";

/** @typedef {WebGL2RenderingContext} GL */

/**
 * A context of the canvas, opaque and without depth buffer (splats are drawn in order). Throws a PageError: no WebGL2.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {GL}
 */
export function createContext(canvas) {
  const gl = canvas.getContext("webgl2", {
    alpha: false, antialias: false, depth: false, powerPreference: "high-performance",
  });
  if (!gl) {
    throw new PageError("This browser offers no WebGL2. Use a current Firefox, Chrome, Edge or Safari, "
      + "and switch hardware acceleration on.");
  }
  return gl;
}

/** A linked program. @param {GL} gl @param {string} vertex @param {string} fragment */
export function createProgram(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, source] of /** @type {[number, string][]} */ ([
    [gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment],
  ])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind)); // null only if the context is lost
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new PageError(`The graphics driver refuses a shader: ${gl.getShaderInfoLog(shader)}`);
    }
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new PageError(`The graphics driver refuses a shader: ${gl.getProgramInfoLog(program)}`);
  }
  /** @type {Record<string, WebGLUniformLocation | null>} */
  const uniforms = {};
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let k = 0; k < count; k++) {
    const name = gl.getActiveUniform(program, k)?.name;
    if (name) uniforms[name] = gl.getUniformLocation(program, name);
  }
  return { use: () => gl.useProgram(program), uniforms };
}

/**
 * An empty texture, read without interpolation.
 *
 * @param {GL} gl @param {number} format @param {number} width @param {number} height
 */
export function createTexture(gl, format, width, height) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  }
  return texture;
}

/**
 * Has the GPU passed this fence? True where there is none.
 *
 * @param {GL} gl @param {WebGLSync | null} fence
 */
export const hasPassed = (gl, fence) =>
  fence === null || gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;

/**
 * Set the camera's axes in a program.
 *
 * @param {GL} gl @param {Record<string, WebGLUniformLocation | null>} uniforms
 * @param {import("../terrain/camera.js").Camera} camera
 */
export function setAxes(gl, uniforms, { right, up, ahead }) {
  gl.uniform3fv(uniforms.right, right);
  gl.uniform3fv(uniforms.up, up);
  gl.uniform3fv(uniforms.ahead, ahead);
}
