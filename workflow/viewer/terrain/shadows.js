// Shadows of the surface on itself: by how much the sun is above the horizon, on a grid about the eye.
// The same numbers as dav_gswt/terrain/light.py; tests/golden/light.json holds both to it.

/**
 * @typedef {import("./sun.js").Sun} Sun
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
const MOST = 2; // of a margin
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
      margins[b * SIZE + a] = Math.min(Math.max(margin, -MOST), MOST);
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
