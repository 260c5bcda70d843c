// The horizon of a planet, for the shaders of SPHERE_BACKDROP.

/**
 * Set what the backdrop of an eye over a sphere needs.
 *
 * @param {import("./gl.js").GL} gl
 * @param {Record<string, WebGLUniformLocation | null>} uniforms
 * @param {{ radius: number }} sphere
 * @param {number[]} eye from the planet's middle
 */
export function setHorizon(gl, uniforms, { radius }, eye) {
  const far = Math.hypot(...eye), height = Math.max(far - radius, 0);
  gl.uniform3fv(uniforms.upward, eye.map((v) => v / far));
  gl.uniform1f(uniforms.dip, Math.sqrt(height * (2 * radius + height)) / far);
  gl.uniform1f(uniforms.height, height / radius);
}
