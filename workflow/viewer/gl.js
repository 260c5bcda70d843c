// The few WebGL2 calls that sky and splats share.

import { PageError } from "./source.js";

/** A context of the canvas, opaque and without depth (splats are drawn in order). Raises: PageError: no WebGL2. */
export function context(canvas) {
  const wanted = { alpha: false, antialias: false, depth: false, powerPreference: "high-performance" };
  const gl = canvas.getContext("webgl2", wanted);
  if (!gl) {
    throw new PageError("This browser offers no WebGL2. Use a current Firefox, Chrome, Edge or Safari, "
      + "and switch hardware acceleration on.");
  }
  return gl;
}

/** Compile and link; uniforms by name. */
export function program(gl, vertex, fragment) {
  const linked = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(linked, shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new PageError(`The graphics driver refuses a shader: ${gl.getShaderInfoLog(shader)}`);
    }
  }
  gl.linkProgram(linked);
  if (!gl.getProgramParameter(linked, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new PageError(`The graphics driver refuses a shader: ${gl.getProgramInfoLog(linked)}`);
  }
  const uniforms = {};
  const count = gl.getProgramParameter(linked, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let k = 0; k < count; k++) {
    const { name } = gl.getActiveUniform(linked, k);
    uniforms[name] = gl.getUniformLocation(linked, name);
  }
  return { use: () => gl.useProgram(linked), uniforms };
}
