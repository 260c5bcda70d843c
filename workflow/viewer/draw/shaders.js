// Shaders of the splats: decode a record, place it on the surface, project it (EWA), weight it by its level.

import {
  CODE_SHIFT, MAX_LEVELS, PAGE, PAGES_A_ROW, PLACES, PLACES_A_ROW, ROW, SLOTS,
} from "../data/layout.js";
import { MAX_TURN, TURN_STEPS } from "../data/layout.js";
import { MAX_OCTAVES } from "../terrain/heights.js";
import { FACES } from "../terrain/sphere.js";
import { lightCode, lightPaint, shineCode } from "./lighting.js";
import { OBJECTS, OVERLAYS } from "./overlays.js";
import { WIND } from "./wind.js";

const AIR = 0.12; // height at which the sky of a planet is 1/e as bright, in radii
/** Distance that leaves 1/e of the far ground's colour, over the distance of the last tiles; see terrain/backdrop.py. */
export const FAR_HAZE = 2.5;
const FAR_SPACING = 0.0525; // of its points, over their distance
const UNCERTAINTY = OVERLAYS.indexOf("uncertainty");

/** A record as a Gaussian; the other end of data/layout.js. */
const DECODE = `
uniform vec3 origin, stride; // centre = origin + stride * 16 bits
uniform vec2 logScale;       // ln(deviation) = x + y * 8 bits
struct Gaussian { vec3 centre, deviation; vec4 paint, turn; }; // turn: the quaternion w x y z, of length 1
Gaussian decodeRecord(uvec4 t) {
  vec3 place = vec3(t.x & 65535u, t.x >> 16, t.y & 65535u);
  vec3 size = vec3(t.y >> 16 & 255u, t.y >> 24, t.z & 255u);
  vec3 turn = (vec3(t.z >> 8 & 255u, t.z >> 16 & 255u, t.z >> 24) - 127.0) * ${MAX_TURN / TURN_STEPS};
  vec4 paint = vec4(t.w & 255u, t.w >> 8 & 255u, t.w >> 16 & 255u, t.w >> 24) / 255.0;
  float whole = sqrt(max(1.0 - dot(turn, turn), 0.0));
  return Gaussian(origin + stride * place, exp(logScale.x + logScale.y * size), paint, vec4(whole, turn));
}`;

/** Sky and far ground behind the tiles; the last tiles are blended into it. */
export const BACKDROP = `
uniform vec3 zenith, horizon, ground;
uniform float low; // sine of the angle below the horizon at which tiles end
vec3 backdrop(float rise) {
  vec3 above = mix(horizon, zenith, sqrt(clamp(rise, 0.0, 1.0)));
  vec3 below = mix(ground, horizon, exp(clamp(rise, -1.0, 0.0) / (0.3 * low)));
  return rise > 0.0 ? above : below;
}`;

/**
 * The same where the ground is neither level nor a sphere: haze by distance, which ends at the horizon of a plane through
 * the lowest ground.
 */
export const roughBackdrop = (/** @type {boolean} */ lit) => `
uniform vec3 zenith, horizon, ground;
uniform float low;
uniform float haze; // a unit's share of the distance that leaves 1/e of the ground's colour
${shineCode(lit)}
vec3 farColour(float distance, vec3 shine) { return mix(horizon, clamp(ground * shine, 0.0, 1.0), exp(-haze * distance)); }
vec3 backdrop(float rise) {
  vec3 above = mix(horizon, zenith, sqrt(clamp(rise, 0.0, 1.0)));
  vec3 below = mix(horizon, clamp(ground * shineOn(vec2(0.0), 1.0), 0.0, 1.0), exp(low / (${FAR_HAZE.toFixed(1)} * min(rise, -1e-6))));
  return rise > 0.0 ? above : below;
}`;

const FLAT = `vec3 surface(vec2 at) { return vec3(0.0); }`;

const HASH = `
uint mixBits(uint h) {
  h = (h ^ h >> 16) * 0x85ebca6bu;
  h = (h ^ h >> 13) * 0xc2b2ae35u;
  return h ^ h >> 16;
}
/* Gradients of the noise at the corners of a cell: south-west, south-east, north-west, north-east. Signed integers,
   which software renderers turn into floats in one step; seed: of axis and salt */
void findGradients(ivec2 cell, uint seed, out vec4 east, out vec4 north) {
  uint column = uint(cell.x) * 0x8da6b343u, row = uint(cell.y) * 0xd8163841u;
  uvec2 mixed = uvec2(mixBits(column ^ seed), mixBits(column + 0x8da6b343u ^ seed));
  uvec2 south = mixed + row, far = south + 0xd8163841u;
  uvec4 bits = uvec4(mixBits(south.x), mixBits(south.y), mixBits(far.x), mixBits(far.y));
  east = vec4(ivec4(bits & 0xffffu)) / 32767.5 - 1.0;
  north = vec4(ivec4(bits >> 16)) / 32767.5 - 1.0;
}`;

/** @param {{ before?: string, kept?: string }} octave k: code before it, and a factor of it */
const hills = ({ before = "", kept = "" } = {}) => `
uniform ivec2 cellUnder[${MAX_OCTAVES}]; // the noise's cell under the eye, octave by octave, and the place in it
uniform vec2 placeUnder[${MAX_OCTAVES}];
uniform float amplitude[${MAX_OCTAVES}], scale[${MAX_OCTAVES}];
uniform int octaves;
uniform uint salt;
vec3 surface(vec2 at) { // height and slope at a place seen from the eye
  vec3 sum = vec3(0.0);
  for (int k = 0; k < octaves; k++) {${before}
    vec2 p = placeUnder[k] + at * scale[k], cell = floor(p), t = p - cell;
    vec2 fade = t * t * t * (t * (6.0 * t - 15.0) + 10.0), turn = 30.0 * t * t * (t * (t - 2.0) + 1.0);
    vec4 east, north;
    findGradients(cellUnder[k] + ivec2(cell), uint(3 + k) * 0xcb1ab31fu ^ salt, east, north);
    vec4 planes = east * (t.x - vec4(0, 1, 0, 1)) + north * (t.y - vec4(0, 0, 1, 1));
    vec4 across = vec2(1.0 - fade.x, fade.x).xyxy, along = vec2(1.0 - fade.y, fade.y).xxyy, weight = across * along;
    vec3 noise = vec3(dot(weight, planes), dot(weight, east) + turn.x * dot(vec4(-1, 1, -1, 1) * along, planes),
      dot(weight, north) + turn.y * dot(vec4(-1, -1, 1, 1) * across, planes));
    sum += ${kept}amplitude[k] * noise * vec3(1.0, scale[k], scale[k]);
  }
  return sum;
}`;

/**
 * Change of a material's colours at a place seen from the eye. Without loops: software renderers take twice as long.
 *
 * @param {number} waves @param {number} materials
 */
const variationCode = (waves, materials) => `
uniform ivec2 waveUnder[${waves}]; // as cellUnder and placeUnder
uniform vec2 wavePlace[${waves}], waveScale[${waves}]; // scale: cosine and sine of the turn, in cells a unit
uniform vec3 waveColours[${waves * materials}];
uniform uint waveSeeds[${waves}];
float wave(ivec2 under, vec2 p, uint seed) {
  vec2 low = floor(p), t = p - low, fade = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
  vec4 east, north;
  findGradients(under + ivec2(low), seed, east, north);
  vec4 planes = east * (t.x - vec4(0, 1, 0, 1)) + north * (t.y - vec4(0, 0, 1, 1));
  vec2 rows = mix(planes.xz, planes.yw, fade.x);
  return mix(rows.x, rows.y, fade.y);
}
vec3 variation(vec2 at, int material) {
  return ${Array.from({ length: waves }, (_, k) => `waveColours[${k * materials} + material]
    * wave(waveUnder[${k}], wavePlace[${k}] + mat2(waveScale[${k}], -waveScale[${k}].y, waveScale[${k}].x) * at, waveSeeds[${k}])`).join("\n    + ")};
}`;

const IMAGE = `
uniform highp sampler2D relief;
uniform ivec2 cellUnder[1];
uniform vec2 placeUnder[1];
uniform float scale[1];
int inside(int k, int n) {
  k = ((k % (2 * n)) + 2 * n) % (2 * n);
  return k < n ? k : 2 * n - 1 - k;
}
vec3 surface(vec2 at) { // a quadratic B-spline of the pixels; rows go south
  vec2 p = placeUnder[0] + at * vec2(scale[0], -scale[0]), pixel = floor(p), t = p - pixel - 0.5;
  ivec2 middle = cellUnder[0] + ivec2(pixel), size = textureSize(relief, 0);
  vec2 weight[3] = vec2[3](0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t));
  vec2 turn[3] = vec2[3](t - 0.5, -2.0 * t, t + 0.5);
  vec3 sum = vec3(0.0);
  for (int b = 0; b < 3; b++) for (int a = 0; a < 3; a++) {
    ivec2 texel = ivec2(inside(middle.x + a - 1, size.x), inside(middle.y + b - 1, size.y));
    float value = texelFetch(relief, texel, 0).r;
    vec2 slope = scale[0] * vec2(turn[a].x * weight[b].y, -weight[a].x * turn[b].y);
    sum += value * vec3(weight[a].x * weight[b].y, slope);
  }
  return sum;
}`;

/** Weights of levels by distance, as dav_gswt/terrain/draw_order.py; tests/golden/weights.json holds both to it. */
export const LEVEL_WEIGHTS = `
uniform float switches[${MAX_LEVELS}], bands[${MAX_LEVELS}];
uniform int levels;
float finerShare(float d, float switchAt, float band) {
  return band > 0.0 ? clamp(0.5 - (d - switchAt) / (2.0 * band), 0.0, 1.0) : d < switchAt ? 1.0 : d > switchAt ? 0.0 : 0.5;
}
float levelWeight(int level, float d) {
  float left = 1.0;
  for (int l = 0; l < levels - 1; l++) {
    float share = finerShare(d, switches[l], bands[l]);
    if (l == level) return left * share;
    left *= 1.0 - share;
  }
  return left;
}`;

/** Opacity of a Gaussian that is drawn with a weight: two equal ones of weights w and 1 - w hide as much as one. */
export const CROSSFADE = `
float crossfadeOpacity(float alpha, float weight) {
  return weight < 1.0 ? 1.0 - pow(1.0 - min(alpha, 0.999999), weight) : alpha;
}`;

const SURFACES = { flat: FLAT, hills: hills(), image: IMAGE };

/** The surface without detail that points of the far ground cannot show. @param {"hills" | "image"} kind */
export const farSurface = (kind) => (kind === "image" ? IMAGE
  : HASH + hills({
    before: `
    float share = min(2.0 - ${4 * FAR_SPACING} * length(at) * scale[k], 1.0);
    if (share <= 0.0) break;`, kept: "share * ",
  }));

/** @param {import("../terrain/heights.js").HeightField["kind"]} kind @param {boolean} lit below a sun that moves? */
export const backdropCode = (kind, lit) => (kind === "sphere" ? SPHERE_BACKDROP : kind === "flat" ? BACKDROP : roughBackdrop(lit));

// What differs between a plane and a sphere: which cell or object an entry belongs to, where its Gaussian is seen from the
// eye, and how its axes follow the ground.
const PLANE_CODE = `  if (code >= ${PLACES}u) {
    place = code - ${PLACES - 1}u;
  } else if (code >= ${SLOTS}u) {
    uint slot = (code - ${SLOTS}u) / ${MAX_LEVELS}u;
    cell = vec2(int(slot % 3u) - 1, int(slot / 3u) - 1);
    mark = marks[slot];
  }`;

const PLACE_ON_PLANE = `  vec2 way = vec2(1.0, 0.0); // cosine and sine of an object's turn
  if (place > 0u) { // turned and scaled about the foot, which is the middle of a tile in the records
    ivec2 first = ivec2(2 * int((place - 1u) % ${PLACES_A_ROW}u), int((place - 1u) / ${PLACES_A_ROW}u));
    uvec4 where = texelFetch(places, first, 0), what = texelFetch(places, first + ivec2(1, 0), 0);
    cell = uintBitsToFloat(where.xy);
    vec2 large = uintBitsToFloat(where.zw), from = one.centre.xy - 0.5 * side;
    float size = uintBitsToFloat(what.y);
    way = large / size;
    one.centre = vec3(large.x * from.x - large.y * from.y, large.y * from.x + large.x * from.y,
      size * one.centre.z + uintBitsToFloat(what.x));
    one.deviation *= size;
    mark = what.z;
    if (code >= ${PLACES}u) level = int(what.w);
  }
  vec3 seen = one.centre + vec3(cell * side, 0.0) + corner;
  vec3 rise = surface(seen.xy);
  seen.z += rise.x;`;

const SHEAR = `    if (place > 0u) axes[k].xy = vec2(way.x * axes[k].x - way.y * axes[k].y, way.y * axes[k].x + way.x * axes[k].y);
    axes[k].z += dot(rise.yz, axes[k].xy); // the surface shears shapes along its slope`;

const VARY = `  vec2 spot = place > 0u ? cell * side + corner.xy : seen.xy; // an object varies as the ground at its foot
  uint soil = texelFetch(owners, ivec2(0, int(row / ${ROW}u)), 0).x >> 8u;
  one.paint.rgb = clamp(one.paint.rgb + variation(spot, int(soil)), 0.0, 1.0);`;

const BEND = `  float bent = bend(texelFetch(stems, ivec2(0, int(row / ${ROW}u)), 0).xy, one.centre.z);
`;

const SWAY = `
  if (bent > 0.0) seen.xy += bent * sway(place > 0u ? cell * side + corner.xy : seen.xy); // an object as a whole`;

/** Sky that thins out with height, and far ground, as dav_gswt/terrain/backdrop.py has them. */
export const SPHERE_BACKDROP = `
uniform vec3 zenith, horizon, ground;
uniform vec3 upward;       // from the planet's middle to the eye, of length 1
uniform float low;         // sine of the angle below the horizon at which tiles end
uniform float dip, height; // sine of the angle of the horizon below the level; of the eye over the ground, in radii
float thinned(float above) {
  float far = max(above, 0.0) / ${AIR.toFixed(3)};
  return exp(-far * far);
}
vec3 backdrop(vec3 way) {
  float rise = dot(way, upward), above = rise + dip;
  float passing = rise > 0.0 ? height : (1.0 + height) * sqrt(max(1.0 - rise * rise, 0.0)) - 1.0;
  vec3 sky = thinned(passing) * mix(horizon, zenith, sqrt(clamp(above / (1.0 + dip), 0.0, 1.0)));
  vec3 below = mix(ground, horizon, thinned(height) * exp(min(above, 0.0) / (0.3 * low)));
  return above > 0.0 ? sky : below;
}`;

const SPHERE = `
uniform vec3 moved;                   // from the eye to that of the frame, whose places count from there
uniform float radius, rate, stretch, begin; // rate: angle of a unit on a tile; stretch: radius times that
const mat3 FACES[6] = mat3[6](${FACES.map((axes) => `mat3(${axes.flat().map((v) => v.toFixed(1)).join(", ")})`).join(",\n  ")});
vec2 tangent(vec2 a) { // of small angles, to single precision; the tan of graphics cards loses them
  vec2 s = a * a;
  return a * (1.0 + s * (1.0 / 3.0 + s * (2.0 / 15.0 + s * (17.0 / 315.0 + s * (62.0 / 2835.0)))));
}`;

// How far a Gaussian is in the transition of the last tiles into the backdrop.
const PLANE_GOING = `float going = 1.0 - clamp(2.0 - 2.0 * distance / end, 0.0, 1.0); // smoothstep from half the reach to its end`;
const SPHERE_GOING = "float going = clamp((distance - begin) / (end - begin), 0.0, 1.0); // from half-way past the ground below";

const FAR_PAINT = { // what it goes over into
  flat: "backdrop(seen.z / distance)", sphere: "backdrop(seen / distance)",
  hills: "farColour(distance, shine)", image: "farColour(distance, shine)",
};

const SPHERE_CODE = `  if (code >= ${SLOTS}u) place = (code - ${SLOTS}u) / ${MAX_LEVELS}u + 1u;`;

/** As terrain/sphere.js bends a tile. */
const PLACE_ON_SPHERE = `
  ivec2 spot = ivec2(2 * int((place - 1u) % ${PLACES_A_ROW}u), int((place - 1u) / ${PLACES_A_ROW}u));
  uvec4 where = texelFetch(places, spot, 0), what = texelFetch(places, spot + ivec2(1, 0), 0);
  vec2 middle = vec2(uintBitsToFloat(where.w), uintBitsToFloat(what.x));
  mat3 face = FACES[what.y];
  mark = what.z;
  vec2 arc = tangent((one.centre.xy - 0.5 * side) * rate);
  vec2 change = (1.0 + middle * middle) * arc / (1.0 - middle * arc), there = middle + change;
  float long0 = sqrt(1.0 + dot(middle, middle)), whole = sqrt(1.0 + dot(there, there));
  float longer = dot(change, 2.0 * middle + change) / (whole + long0);
  vec3 outward = vec3(there, 1.0) / whole, shift = vec3(change, 0.0) - vec3(middle, 1.0) * (longer / long0);
  vec3 seen = uintBitsToFloat(where.xyz) + moved + face * (shift * (radius / whole) + one.centre.z * outward);
  vec2 grow = (stretch + rate * one.centre.z) * (1.0 + there * there) / whole;
  mat3 bent = face * mat3(
    grow.x * (vec3(1.0, 0.0, 0.0) - outward * outward.x), grow.y * (vec3(0.0, 1.0, 0.0) - outward * outward.y), outward);`;

/**
 * @param {import("../terrain/heights.js").HeightField["kind"]} kind
 * @param {import("../terrain/variation.js").Variation | null} varied
 * @param {boolean} lit
 * @param {boolean} windy
 */
export const vertexShader = (kind, varied, lit, windy) => `#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
layout(location = 0) in uvec4 block;
uniform usampler2D records, entries, places;
uniform usampler2D owners;      // of each row of records, the number of the material, or of objects; from bit 8 the material
uniform highp sampler2D hues;   // of overlays, see overlays.js
uniform vec3 right, up, ahead;  // camera axes in the world
uniform vec3 corner;            // south-west corner of the middle cell, on the ground, seen from the eye
uniform vec2 halfSize;          // half the picture, in pixels
uniform float side, focal, near, end;
uniform int overlay;
uniform uint marks[9];          // of the 3 x 3 block of cells about the eye
flat out vec4 colour;
flat out float weight;          // of the Gaussian's level
out vec2 at;                    // in standard deviations from the centre
${DECODE}
${backdropCode(kind, lit)}
${kind === "hills" || varied ? HASH : ""}
${kind === "sphere" ? SPHERE : SURFACES[kind]}
${varied ? variationCode(varied.waves.length, varied.waves[0].colours.length) : ""}${lit ? lightCode(kind) : ""}${windy ? WIND : ""}
mat3 rotation(vec4 q) { // of length 1
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(
    1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
    2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
    2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}
${LEVEL_WEIGHTS}
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0); // culled, unless it is set below
  at = vec2(0.0);
  colour = vec4(0.0);
  weight = 1.0;
  uint lane = uint(gl_VertexID) >> 2u; // four corners each
  if (lane > (block.y >> 16u & ${PAGE - 1}u)) return;
  ivec2 texel = ivec2(int(block.x % ${PAGES_A_ROW}u) * ${PAGE} + int(lane), int(block.x / ${PAGES_A_ROW}u));
  uint entry = texelFetch(entries, texel, 0).x, code = entry >> ${CODE_SHIFT}u, mark = block.z, place = block.w;
  int level = int(code & ${MAX_LEVELS - 1}u);
  vec2 cell = vec2(int(block.y & 255u) - 128, int(block.y >> 8u & 255u) - 128);
${kind === "sphere" ? SPHERE_CODE : PLANE_CODE}
  uint row = entry & ${(1 << CODE_SHIFT) - 1}u;
  Gaussian one = decodeRecord(texelFetch(records, ivec2(int(row & ${ROW - 1}u), int(row / ${ROW}u)), 0));
${windy ? BEND : ""}${kind === "sphere" ? PLACE_ON_SPHERE : PLACE_ON_PLANE}${windy ? SWAY : ""}
  vec3 p = vec3(dot(right, seen), dot(up, seen), dot(ahead, seen));
  if (!(p.z > near)) return;
  float distance = length(seen), opacity = one.paint.a;
  if ((mark >> 24u & 1u) == 0u) weight = levelWeight(level, distance);
  if (weight <= 0.0) return;

  // EWA: covariance A A^T in the picture, with a dilation of 0.3 square pixels. The projection is linearised at a point
  // within 1.3 times the picture, or splats at its edges would become needles.
  mat3 axes = rotation(one.turn);
  for (int k = 0; k < 3; k++) {
    axes[k] *= one.deviation[k];
${kind === "sphere" ? "    axes[k] = bent * axes[k];" : SHEAR}
  }
  mat3 shape = transpose(mat3(right, up, ahead)) * axes;
  vec2 slope = clamp(p.xy / p.z, -1.3 * halfSize / focal, 1.3 * halfSize / focal);
  vec3 depth = vec3(shape[0].z, shape[1].z, shape[2].z);
  vec3 across = (vec3(shape[0].x, shape[1].x, shape[2].x) - slope.x * depth) * (focal / p.z);
  vec3 along = (vec3(shape[0].y, shape[1].y, shape[2].y) - slope.y * depth) * (focal / p.z);
  // Where the extent in depth is large against the depth, the linearised splat would cover the picture up to the
  // horizon as haze, so it fades out.
  opacity *= smoothstep(1.8, 3.2, p.z / max(length(depth), 1e-9));
  // what its weight leaves fainter than 1/255; see crossfadeOpacity
  float faintest = weight < 1.0 ? 1.0 - pow(254.0 / 255.0, 1.0 / weight) : 1.0 / 255.0;
  if (opacity <= faintest) return;
  float a = dot(across, across) + 0.3, b = dot(across, along), c = dot(along, along) + 0.3;

  float mean = 0.5 * (a + c), lean = 0.5 * (a - c), spread = length(vec2(lean, b));
  vec2 major = lean > 0.0 ? vec2(lean + spread, b) : vec2(b, spread - lean);
  major = spread < 1e-6 * mean ? vec2(1.0, 0.0) : normalize(major);
  vec2 lengths = sqrt(vec2(mean + spread, max((a * c - b * b) / (mean + spread), 0.3)));
  float reach = sqrt(2.0 * log(opacity / faintest));
  at = (vec2(gl_VertexID & 1, gl_VertexID >> 1 & 1) * 2.0 - 1.0) * reach;
  vec2 pixel = focal * p.xy / p.z + at.x * lengths.x * major + at.y * lengths.y * vec2(-major.y, major.x);
  ${kind === "sphere" ? SPHERE_GOING : PLANE_GOING}
  vec3 shine = vec3(1.0);
${varied ? VARY : ""}${lit ? `\n${lightPaint(kind)}` : ""}
  vec3 paint = mix(one.paint.rgb, ${FAR_PAINT[kind]}, going * going * (3.0 - 2.0 * going));
  if (overlay > 0) {
    uint owner = texelFetch(owners, ivec2(0, int(row / ${ROW}u)), 0).x;
    uint numbers[5] = uint[5](mark & 255u, uint(level) * 32u, mark >> 8u & 255u, mark >> 16u & 255u, owner & 255u);
    uint number = numbers[overlay - 1];
    float share = overlay == ${UNCERTAINTY} && numbers[4] == ${OBJECTS}u ? 0.0 : 0.7; // objects have no uncertainty
    paint = mix(vec3(dot(paint, vec3(0.3, 0.6, 0.1))), texelFetch(hues, ivec2(int(number), 0), 0).rgb, share);
  }
  colour = vec4(paint, opacity);
  gl_Position = vec4(pixel / halfSize, 0.0, 1.0);
}`;

export const FRAGMENT = `#version 300 es
precision highp float;
flat in vec4 colour;
flat in float weight;
in vec2 at;
out vec4 painted;
${CROSSFADE}
void main() {
  float alpha = colour.a * exp(-0.5 * dot(at, at));
  alpha = min(0.99, crossfadeOpacity(alpha, weight));
  if (alpha < 1.0 / 255.0) discard;
  painted = vec4(colour.rgb * alpha, alpha);
}`;
