// Light in the shaders: code for the light of ground and sky, their uniforms, and the texture of shadows.

import { GAMMA, MOST, SIZE } from "../terrain/light.js";
import { createTexture } from "./gl.js";

/**
 * @typedef {import("./gl.js").GL} GL
 * @typedef {import("../terrain/light.js").Lighting} Lighting
 * @typedef {Record<string, WebGLUniformLocation | null>} Uniforms
 */

const LEVEL_CODE = `
uniform vec3 levelLight;`;

/** What sRGB colours of ground are multiplied by. share: of the sun that it sees. @param {boolean} lit */
export const shineCode = (lit) => (!lit ? "vec3 shineOn(vec2 slope, float share) { return vec3(1.0); }" : `
uniform vec3 toSun, direct, ambient;
vec3 shineOn(vec2 slope, float share) {
  float n = inversesqrt(1.0 + dot(slope, slope)), lambert = max((toSun.z - dot(toSun.xy, slope)) * n, 0.0);
  vec3 ratio = min(direct * (lambert * share) + ambient * (0.5 + 0.5 * n), ${MOST.toFixed(1)});
  return pow(ratio, vec3(${1 / GAMMA}));
}`);

const SHADOW_CODE = `
uniform highp sampler2D shadows; // margins of terrain/light.js
uniform vec2 shadowUnder;        // the eye in that texture
uniform float shadowScale, soft; // of places seen from the eye; margin at which the sun is whole
float sunShare(vec2 at) {
  return clamp(0.5 + textureLod(shadows, shadowUnder + at * shadowScale, 0.0).r / (2.0 * soft), 0.0, 1.0);
}`;

/** What a vertex shader declares, by the kind of its surface. @param {string} kind */
export const lightCode = (kind) => (kind === "flat" ? LEVEL_CODE : SHADOW_CODE);

/** Change of a Gaussian's colour; objects are lit as the ground below them. @param {string} kind */
export const lightPaint = (kind) => (kind === "flat" ? "  one.paint.rgb = clamp(one.paint.rgb * levelLight, 0.0, 1.0);"
  : `  shine = shineOn(rise.yz, sunShare(seen.xy));
  one.paint.rgb = clamp(one.paint.rgb * shine, 0.0, 1.0);`);

/** Glow of the sky about the sun, see terrain/light.py. */
export const GLOW = `
  if (ray.z > 0.0) seen = mix(seen, sunColour, 0.35 * pow(1.0 - sun.z, 4.0) * pow(max(close, 0.0), 6.0));`;

/**
 * Set the colours of the backdrop, and of a Gaussian's light.
 *
 * @param {GL} gl @param {Uniforms} uniforms @param {import("../data/manifest.js").Manifest} manifest
 * @param {Lighting | null} light
 */
export function setLight(gl, uniforms, { sky, ground_colour: ground }, light) {
  gl.uniform3fv(uniforms.zenith, light?.zenith ?? sky.zenith);
  gl.uniform3fv(uniforms.horizon, light?.horizon ?? sky.horizon);
  gl.uniform3fv(uniforms.ground, light && !uniforms.toSun ? light.ground : ground); // on hills the shader lights it
  if (!light) return;
  gl.uniform3fv(uniforms.levelLight, light.level);
  gl.uniform3fv(uniforms.toSun, light.sun.direction);
  gl.uniform3fv(uniforms.direct, light.direct);
  gl.uniform3fv(uniforms.ambient, light.ambient);
}

/** The texture of shadows, in which all is in the sun at first. @param {GL} gl */
export function createShadowTexture(gl) {
  const texture = createTexture(gl, gl.R16F, SIZE, SIZE);
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) gl.texParameteri(gl.TEXTURE_2D, name, value);
  /** @param {Float32Array} margins */
  const fill = (margins) => gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, SIZE, SIZE, gl.RED, gl.FLOAT, margins);
  fill(new Float32Array(SIZE * SIZE).fill(1));
  /** @type {Float32Array | null} */
  let shown = null;
  return {
    texture,
    /**
     * Set what a picture needs; the texture is bound.
     *
     * @param {Uniforms} uniforms @param {import("../terrain/light.js").Shadows | null} shadows @param {number[]} eye
     */
    set(uniforms, shadows, eye) {
      if (shadows && shadows.margins !== shown) {
        shown = shadows.margins;
        fill(shown);
      }
      const { first, cell, soft } = shadows ?? { first: [0, 0], cell: 1, soft: 1 };
      gl.uniform2fv(uniforms.shadowUnder, first.map((v, k) => ((eye[k] - v) / cell + 0.5) / SIZE));
      gl.uniform1f(uniforms.shadowScale, 1 / (cell * SIZE));
      gl.uniform1f(uniforms.soft, soft);
    },
  };
}
