// Wind: what stands sways, the more the higher above its foot. Gusts are two waves of place and time. Orders of Gaussians
// stay as they are, so the sway is small against the height.

/**
 * @typedef {import("../data/manifest.js").Manifest} Manifest
 *
 * seconds: of the gusts; share: of the manifest's wind that blows.
 * @typedef {{ seconds: number, share: number }} Wind
 */

const SWAY = 0.1; // of the height, in the strongest gust of a wind of 1
const WAY = [0.8, 0.6]; // that the wind blows, to the east and to the north
const WAVES = [ // of gusts: their length in eye floors, their way as cosine and sine of the angle to the wind's, seconds
  { length: 6, turn: [0.96, 0.28], period: 3.1, share: 0.6 }, { length: 1.7, turn: [0.8, -0.6], period: 1.3, share: 0.4 },
];
const STANDS = 0.06, TALL = 0.1; // of tiles: heights over the ground where plants begin and are tallest, in eye floors
const MANY = 0.01; // share of a tile's Gaussians above that: fewer are stones
const SLIM = 8; // standard deviations that what sways is high, at least: at coarser levels none would see it

/** The vertex shader's functions; after them: where a Gaussian is bent, and where it goes. */
export const WIND = `
uniform highp sampler2D stems; // of each row of records: z above which Gaussians sway, height at which they sway most
uniform vec2 lean, gusts;      // way at full height, over the height; angles of the waves under the eye
uniform vec4 waves;            // angles a unit
float bend(vec2 stem, float z) { // of a Gaussian at height z
  float high = stem.y > 0.0 ? clamp((z - stem.x) / stem.y, 0.0, 1.0) : 0.0;
  return high * high * stem.y;
}
vec2 sway(vec2 at) {
  vec2 angles = gusts + vec2(dot(waves.xy, at), dot(waves.zw, at));
  return lean * dot(vec2(${WAVES.map(({ share }) => share.toFixed(2)).join(", ")}), sin(angles));
}`;

/**
 * From where and how high the Gaussians of a chunk sway: z and a height, which is 0 where none do. An object sways if it
 * stands at least as high as a half ball on its footprint; what of a tile stands above its ground are plants if there is
 * enough of it.
 *
 * @param {Manifest} manifest @param {{ tile: number, level: number, records: Uint32Array }} chunk
 * @returns {[number, number]}
 */
export function measureStem(manifest, { tile, level, records }) {
  const { tiles, materials, objects = [], levels, classes, eye_floor: floor, encoding: { origin, step } } = manifest;
  const object = objects[tile - tiles.length], material = Math.floor((tile * materials.length) / tiles.length);
  const ground = classes?.rise.ground[material] ?? objects[0]?.ground ?? 0;
  const begin = object ? 0 : ground + STANDS * floor, least = (begin - origin[2]) / step[2];
  let top = 0, above = 0;
  for (let k = 1; k < records.length; k += 4) {
    const z = records[k] & 65535;
    if (z > least) above += 1;
    if (z > top) top = z;
  }
  const height = object ? origin[2] + step[2] * top : TALL * floor;
  const stands = object ? height >= object.radius : above >= MANY * (records.length / 4);
  return [begin, stands && height >= SLIM * (levels[level].mean_scale ?? 0) ? height : 0];
}

/**
 * @param {import("./gl.js").GL} gl @param {Record<string, WebGLUniformLocation | null>} uniforms
 * @param {Manifest} manifest @param {Wind} wind @param {number[]} eye
 */
export function setWind(gl, uniforms, { wind: strength = 0, eye_floor: floor }, { seconds, share }, [x, y]) {
  const waves = WAVES.map(({ length, turn: [c, s] }) => (
    [WAY[0] * c - WAY[1] * s, WAY[1] * c + WAY[0] * s].map((v) => (2 * Math.PI * v) / (length * floor))));
  const under = waves.map(([a, b], k) => (a * x + b * y - (2 * Math.PI * seconds) / WAVES[k].period) % (2 * Math.PI));
  gl.uniform2fv(uniforms.lean, WAY.map((v) => SWAY * strength * share * v));
  gl.uniform2fv(uniforms.gusts, under);
  gl.uniform4fv(uniforms.waves, waves.flat());
}
