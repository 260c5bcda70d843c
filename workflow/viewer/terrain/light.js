// Light of the place: ground and sky as the sun moves. Colours of Gaussians contain the light of level ground below the
// captured sun; they are multiplied by the ratio of their own light to it, in linear light. The sun and the clear sky have
// light in three bands. Shadows of the surface on itself: by how much the sun is above the horizon, on a grid about the
// eye. Angles are in degrees: elevation above the horizon, azimuth clockwise from the terrain's +y; `north` is the azimuth
// of +y, clockwise from true north.
// The same numbers as dav_gswt/terrain/light.py; tests/golden/light.json holds both to it.

/**
 * @typedef {import("./heights.js").HeightField} HeightField
 *
 * margins: tangent of the sun's elevation minus the tangent of the horizon's, rows from the south; first: world
 * position of the south-western point; soft: the margin at which the sun is whole.
 * @typedef {{ margins: Float32Array, first: [number, number], cell: number, soft: number }} Shadows
 */

export const SIZE = 256; // points along a side of the grid
const CELL = 0.375; // their distance, in tile sides
const SNAP = 32; // points by which the grid moves with the eye
const STEPS = 40, FARTHEST = 64; // samples towards the sun, from 1 to so many cells away
const BORDER = 16; // points along the edge of the grid over which shadows end
const MOST_MARGIN = 2; // of a margin
const SOFT = 0.02; // half the width of a shadow's edge, as a change of the sun's elevation in radians
const STEEPEST = 80; // elevation, of which the tangent is taken: above, the most of a margin would be no whole sun
const PAD = FARTHEST + 1, WIDE = SIZE + 2 * PAD; // the heights repeat beyond the edge of the grid

/** @param {Sun} sun */
const tangentOf = ({ elevation }) => Math.tan((Math.min(elevation, STEEPEST) * Math.PI) / 180);

/**
 * Heights of the grid's points with a padding, in steps of a row.
 *
 * @param {HeightField} heights @param {number[]} first @param {number} cell
 * @returns {Generator<void, Float64Array>}
 */
function* sampleHeights(heights, first, cell) {
  const found = new Float64Array(WIDE * WIDE);
  for (let b = 0; b < SIZE; b++) {
    const row = (b + PAD) * WIDE;
    for (let a = 0; a < SIZE; a++) found[row + PAD + a] = heights.at(first[0] + a * cell, first[1] + b * cell)[0];
    found.fill(found[row + PAD], row, row + PAD);
    found.fill(found[row + PAD + SIZE - 1], row + PAD + SIZE, row + WIDE);
    yield;
  }
  for (let b = 0; b < PAD; b++) {
    found.copyWithin(b * WIDE, PAD * WIDE, (PAD + 1) * WIDE);
    found.copyWithin((WIDE - 1 - b) * WIDE, (PAD + SIZE - 1) * WIDE, (PAD + SIZE) * WIDE);
  }
  return found;
}

/**
 * Margins of the sun at the points of a grid of padded heights, in steps of a row. Along the edge of the grid the
 * horizon is lowered, so that shadows end softly there.
 *
 * @param {Float64Array} heights @param {number} cell @param {Sun} sun
 * @returns {Generator<void, Float32Array>}
 */
function* measureMargins(heights, cell, sun) {
  const margins = new Float32Array(SIZE * SIZE), horizon = new Float64Array(SIZE), tangent = tangentOf(sun);
  const azimuth = (sun.azimuth * Math.PI) / 180;
  const samples = Array.from({ length: STEPS }, (_, k) => {
    const far = FARTHEST ** (k / (STEPS - 1)), x = far * Math.sin(azimuth), y = far * Math.cos(azimuth);
    const [i, j] = [Math.floor(x), Math.floor(y)];
    return { to: j * WIDE + i, u: x - i, v: y - j, scale: 1 / (far * cell) };
  });
  for (let b = 0; b < SIZE; b++) {
    const row = (b + PAD) * WIDE + PAD;
    horizon.fill(-Infinity);
    for (const { to, u, v, scale } of samples) {
      const south = (1 - u) * (1 - v), east = u * (1 - v), north = (1 - u) * v, both = u * v;
      for (let a = 0; a < SIZE; a++) {
        const at = row + a, k = at + to;
        const seen = south * heights[k] + east * heights[k + 1]
          + north * heights[k + WIDE] + both * heights[k + WIDE + 1];
        horizon[a] = Math.max(horizon[a], (seen - heights[at]) * scale);
      }
    }
    for (let a = 0; a < SIZE; a++) {
      const inside = Math.min(Math.min(a, b, SIZE - 1 - a, SIZE - 1 - b) / BORDER, 1);
      const margin = tangent - (inside * horizon[a] - (1 - inside));
      margins[b * SIZE + a] = Math.min(Math.max(margin, -MOST_MARGIN), MOST_MARGIN);
    }
    yield;
  }
  return margins;
}

/**
 * Shadows of a surface about an eye, made in steps; the last whole ones stay until the next are. The grid lies on
 * multiples of its cells in the world. Heights are kept while only the sun moves.
 *
 * @param {HeightField} heights @param {number} side of a tile
 */
export function createShadows(heights, side) {
  const cell = CELL * side;
  /** @type {{ first: [number, number], heights: Float64Array } | null} */
  let ground = null;
  /** @type {(Shadows & { sun: Sun }) | null} */
  let made = null;
  /** @type {Generator<void, Shadows & { sun: Sun }> | null} */
  let job = null;

  /** @param {[number, number]} first @param {Sun} sun @returns {NonNullable<typeof job>} */
  function* make(first, sun) {
    if (ground?.first.join() !== first.join()) ground = { first, heights: yield* sampleHeights(heights, first, cell) };
    const margins = yield* measureMargins(ground.heights, cell, sun);
    return { margins, first, cell, soft: SOFT * (1 + tangentOf(sun) ** 2), sun };
  }

  return {
    /** The last whole shadows; null: none yet. @returns {Shadows | null} */
    get made() {
      return made;
    },
    /**
     * Work on the shadows that an eye sees below a sun, for some milliseconds. Returns: are they whole?
     *
     * @param {number} x of the eye @param {number} y @param {Sun} sun @param {number} milliseconds
     */
    step(x, y, sun, milliseconds) {
      const first = /** @type {[number, number]} */ ([x, y].map((v) => (
        (SNAP * Math.floor(v / (SNAP * cell) + 0.5) - SIZE / 2) * cell)));
      const end = performance.now() + milliseconds;
      while (made?.sun !== sun || made.first.join() !== first.join()) {
        if (performance.now() > end) return false;
        job ??= make(first, sun); // what was begun is ended: somebody who flies fast would see no shadows
        const { done, value } = job.next();
        if (done) [made, job] = [value, null];
      }
      return true;
    },
  };
}

const RAYLEIGH = [0.0496, 0.0987, 0.2267]; // optical depths of air at 0.65, 0.55 and 0.45 micrometres
const AEROSOL = [0.0805, 0.1, 0.1298]; // of clear, dry haze
const FORWARD = 0.756; // share of the light scattered by haze that reaches the ground
const LUMINANCE = [0.2126, 0.7152, 0.0722];
export const LOWEST = 3; // elevation below which the light no longer changes, and which the day leaves out
export const SUNRISE = 6, SUNSET = 18; // hours
const DEGREE = Math.PI / 180;

/**
 * A position of the sun; direction: unit vector towards it.
 * @typedef {{ elevation: number, azimuth: number, direction: [number, number, number] }} Sun
 */

/** @param {number} elevation @param {number} azimuth @returns {Sun} */
export function placeSun(elevation, azimuth) {
  const [e, a] = [elevation * DEGREE, azimuth * DEGREE];
  return { elevation, azimuth, direction: [Math.cos(e) * Math.sin(a), Math.cos(e) * Math.cos(a), Math.sin(e)] };
}

/**
 * Irradiance across the sun's beam, of level ground by the sky, and by both, over that outside the atmosphere: red,
 * green, blue. A clear sky after Bird and Hulstrom (1981), with the air mass of Kasten and Young (1989).
 *
 * @param {number} elevation
 */
export function measureLight(elevation) {
  const e = Math.max(elevation, LOWEST), rise = Math.sin(e * DEGREE);
  const mass = 1 / (rise + 0.50572 * (e + 6.07995) ** -1.6364);
  const air = RAYLEIGH.map((depth) => Math.exp(-mass * depth)), haze = AEROSOL.map((depth) => Math.exp(-mass * depth));
  const direct = air.map((v, k) => v * haze[k]);
  const sky = air.map((v, k) => rise * (0.5 * (1 - v) + FORWARD * (1 - haze[k])));
  return { direct, sky, level: direct.map((v, k) => v * rise + sky[k]) };
}

/** @param {number[]} colour in linear light */
export const luminance = (colour) => colour.reduce((sum, v, k) => sum + LUMINANCE[k] * v, 0);

/** Solar time of the captured sun on the path of `sunAt`. @param {Sun} captured @param {number} north */
export function findHour({ elevation, azimuth }, north) {
  const [x, y, z] = placeSun(elevation, azimuth + north).direction;
  return SUNRISE + (Math.atan2(Math.hypot(y, z), x) / Math.PI) * (SUNSET - SUNRISE);
}

/**
 * The sun at a solar time, on the path of an equinox: through the captured sun, from due east to due west. Hours at which it would be lower than LOWEST give the nearest one at which it is not.
 *
 * @param {Sun} captured @param {number} hour @param {number} north
 * @returns {Sun & { hour: number }}
 */
export function sunAt(captured, hour, north) {
  const [, y, z] = placeSun(captured.elevation, captured.azimuth + north).direction;
  const far = Math.hypot(y, z), first = Math.asin(Math.min(Math.sin(LOWEST * DEGREE) / (z / far), 1));
  const asked = ((hour - SUNRISE) / (SUNSET - SUNRISE)) * Math.PI;
  const angle = Math.min(Math.max(asked, first), Math.PI - first);
  const east = Math.cos(angle), ahead = (Math.sin(angle) * y) / far, up = (Math.sin(angle) * z) / far;
  const azimuth = (Math.atan2(east, ahead) / DEGREE - north + 720) % 360;
  const hourOf = SUNRISE + (angle / Math.PI) * (SUNSET - SUNRISE);
  return { hour: hourOf, ...placeSun(Math.atan2(up, Math.hypot(east, ahead)) / DEGREE, azimuth) };
}

/**
 * A manifest's `light`: the captured sun, and where it is known from.
 * @typedef {{ elevation: number, azimuth: number, source: string, north?: number }} LightEntry
 * @typedef {Sun & { hour: number }} DaySun
 *
 * direct: sunlight on ground that faces the sun; ambient: skylight on level ground; both relative to the captured light
 * of level ground. level: factor of the sRGB colours of open, level ground. Other colours are sRGB. shadows: null: not
 * made yet.
 * @typedef {{ sun: DaySun, direct: number[], ambient: number[], level: number[], zenith: number[], horizon: number[],
 *   ground: number[], sunColour: number[], shadows: Shadows | null }} Lighting
 * @typedef {NonNullable<ReturnType<typeof createLight>>} Light
 *
 * An hour of the day, null for the captured sun, or no light: colours as captured.
 * @typedef {number | null | "off"} ChosenSun
 */

export const GAMMA = 2.2; // exponent that stands for the curve of sRGB
export const MOST = 4; // times the captured light, of any ground
const EXPOSED = 0.7; // share of a change of brightness, in stops, that the exposure makes up for
const HAZE = 0.1; // share of the sun's beam in the light of the horizon
const TURN = 8; // milliseconds of work on shadows between which others have a turn

/** Multiply sRGB colours in linear light. @param {number[]} colour @param {number[]} ratio */
const relight = (colour, ratio) => colour.map((v, k) => Math.min(Math.max(v * ratio[k] ** (1 / GAMMA), 0), 1));

/**
 * The light below a sun, without its shadows.
 *
 * @param {Pick<import("../data/manifest.js").Manifest, "sky" | "ground_colour">} manifest
 * @param {Sun} captured @param {DaySun} sun
 * @returns {Omit<Lighting, "shadows">}
 */
export function lightBelow({ sky, ground_colour: ground }, captured, sun) {
  const before = measureLight(captured.elevation), now = measureLight(sun.elevation);
  const exposure = (luminance(before.level) / luminance(now.level)) ** EXPOSED;
  const direct = now.direct.map((v, k) => (exposure * v) / before.level[k]);
  const ambient = now.sky.map((v, k) => (exposure * v) / before.level[k]);
  const level = direct.map((v, k) => Math.min(v * Math.max(sun.direction[2], 0) + ambient[k], MOST));
  const above = now.sky.map((v, k) => (exposure * v) / before.sky[k]);
  const [hazeBefore, hazeNow] = [before, now].map((one) => one.sky.map((v, k) => v + HAZE * one.direct[k]));
  const haze = hazeNow.map((v, k) => (exposure * v) / hazeBefore[k]);
  /** No brighter than it was captured. @param {number[]} ratio */
  const dim = (ratio) => ratio.map((v) => v / Math.max(luminance(ratio), 1));
  const brightest = Math.max(...now.direct);
  return {
    sun, direct, ambient, level: level.map((v) => v ** (1 / GAMMA)), zenith: relight(sky.zenith, dim(above)),
    horizon: relight(sky.horizon, dim(haze)), ground: relight(ground, level),
    sunColour: now.direct.map((v) => (v / brightest) ** (1 / GAMMA)),
  };
}

/**
 * The light of a terrain, at first as captured; null where the captured sun is not known, and on a planet.
 *
 * @param {import("../data/manifest.js").Manifest} manifest @param {import("./heights.js").HeightField} heights
 */
export function createLight(manifest, heights) {
  if (!manifest.light || heights.kind === "sphere") return null;
  const { elevation, azimuth, north = 0 } = manifest.light, captured = placeSun(elevation, azimuth);
  const capturedHour = findHour(captured, north);
  const shadows = heights.kind === "flat" ? null : createShadows(heights, manifest.tile_side);
  /** @type {ChosenSun} */
  let chosen = null;
  /** @type {Omit<Lighting, "shadows"> | null} */
  let below = null;

  /** @param {ChosenSun} sun */
  function choose(sun) {
    const placed = typeof sun === "number" ? sunAt(captured, sun, north) : { ...captured, hour: capturedHour };
    chosen = typeof sun === "number" ? placed.hour : sun;
    below = sun === "off" ? null : lightBelow(manifest, captured, placed);
  }
  choose(null);

  const light = {
    choose,
    capturedHour,
    north,
    get chosen() {
      return chosen;
    },
    /** What is drawn now; null: colours as captured. @returns {Lighting | null} */
    get now() {
      return below && { ...below, shadows: shadows?.made ?? null };
    },
    /**
     * Work on shadows for some milliseconds. Returns: are those that an eye sees whole?
     *
     * @param {number[]} eye @param {number} milliseconds
     */
    step: ([x, y], milliseconds) => !below || !shadows || shadows.step(x, y, below.sun, milliseconds),
    /** Make the shadows that an eye sees. @param {number[]} eye */
    async finish(eye) {
      while (!light.step(eye, TURN)) await new Promise((done) => setTimeout(done));
    },
  };
  return light;
}
