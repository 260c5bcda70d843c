// Classes of the terrain: which material lies at a place, and which Gaussians stay where materials meet.
// The same numbers as dav_gswt/terrain/classes.py, where the idea is; tests/golden/classes.json holds both to it.

import { createCellRing } from "./caches.js";
import { createNoise, SHIFT } from "./heights.js";
import { applyPaint, createPainted } from "./painted.js";
import { createJitter, MAX_OCTAVES } from "./variation.js";

/**
 * Scores at the corners of a cell's lattice, row by row from the south-west, of all materials.
 * @typedef {Float64Array} Lattice
 */

export const LATTICE = 8; // squares of the lattice of scores along a tile's side
export const POINTS = LATTICE + 1;
export const SURE = 1e-9; // of scores: more than rounding can change
export const LOW = LATTICE * LATTICE; // added to the square of a Gaussian that has no bonus
export const GOES = 0, UNDECIDED = 1, STAYS = 2; // what happens to a material's Gaussians in a square

/** The square of a cell's lattice over a place; beyond the cell the nearest one. @param {number} u */
export const squareOf = (u) => Math.min(Math.max(Math.floor(u * LATTICE), 0), LATTICE - 1);

/**
 * Materials that may have a Gaussian in a cell: those that come within `slack` of all others in a square.
 *
 * @param {Lattice} lattice @param {number} materials @param {number} slack
 */
export function findMaterials(lattice, materials, slack) {
  let bits = 0;
  for (let m = 0; m < materials; m++) {
    for (let square = 0; square < LATTICE * LATTICE && !((bits >> m) & 1); square++) {
      let close = true;
      for (let o = 0; o < materials && close; o++) {
        close = o === m || mostLead(lattice, materials, square, m, o) >= -slack;
      }
      if (close) bits |= 1 << m;
    }
  }
  return bits;
}

/**
 * Shares of the squares of a cell's lattice by the material with the highest score in the middle, of equals the first.
 *
 * @param {Lattice} lattice @param {number} materials
 */
export function measureShares(lattice, materials) {
  const shares = new Float64Array(materials), square = 1 / (LATTICE * LATTICE), above = POINTS * materials;
  for (let b = 0; b < LATTICE; b++) {
    for (let a = 0; a < LATTICE; a++) {
      let best = 0, most = -Infinity;
      for (let m = 0, at = (b * POINTS + a) * materials; m < materials; m++, at++) {
        const sum = lattice[at] + lattice[at + materials] + lattice[at + above] + lattice[at + above + materials];
        if (sum > most) [best, most] = [m, sum];
      }
      shares[best] += square;
    }
  }
  return shares;
}

/**
 * What happens to a material's Gaussians in each square of a cell's lattice, and from LOW on to those without a bonus.
 *
 * @param {Lattice} lattice @param {number} materials
 * @param {number} m the material
 * @param {number} wave @param {number} most
 */
export function decideSquares(lattice, materials, m, wave, most) {
  const states = new Uint8Array(2 * LOW);
  for (let square = 0; square < LOW; square++) {
    let state = STAYS, low = STAYS;
    for (let o = 0; o < materials && state !== GOES; o++) {
      if (o === m) continue;
      const lead = mostLead(lattice, materials, square, m, o);
      if (lead < -wave - most) state = GOES;
      else if (!(-mostLead(lattice, materials, square, o, m) >= wave)) state = UNDECIDED;
      if (state === GOES || lead < -wave - SURE) low = GOES;
      else if (low !== GOES) low = state;
    }
    states[square] = state;
    states[LOW + square] = low;
  }
  return states;
}

/**
 * Largest lead of material m over o in a square: a difference of scores is bilinear there, so it is at a corner.
 *
 * @param {Lattice} lattice @param {number} materials @param {number} square @param {number} m
 * @param {number} o
 */
function mostLead(lattice, materials, square, m, o) {
  const south = ((square >> 3) * POINTS + (square & 7)) * materials, north = south + POINTS * materials;
  const sw = lattice[south + m] - lattice[south + o], nw = lattice[north + m] - lattice[north + o];
  const se = lattice[south + materials + m] - lattice[south + materials + o];
  return Math.max(sw, se, nw, lattice[north + materials + m] - lattice[north + materials + o]);
}

/**
 * Terms of the rule in the manifest's `classes`.
 *
 * @typedef {{ kind: "noise", weight: number, wavelengths: number[], gains: number[][], biases: number[] }} NoiseTerm
 * @typedef {{ kind: "height" | "slope", weight: number, material: number, low: number | null, high: number | null,
 *   soft: number }} RangeTerm
 * @typedef {NoiseTerm | RangeTerm} Term
 * @typedef {{ salt: number, rule: Term[], jitter: { cells: number, gains: number[], amplitude: number },
 *   rise: { slope: number, most: number, ground: number[], clearance: number[] }, painted?: number[][] }} ClassesEntry
 *
 * @typedef {import("./heights.js").HeightField} HeightField
 *
 * @typedef {ReturnType<typeof createClasses>} Classes
 */

export const MAX_MATERIALS = 8;
const NOISE = 16; // axis of the hash: octave k of material m uses NOISE + MAX_OCTAVES m + k
const TURN = [0.8, 0.6]; // cosine and sine by which each octave is turned against the last
const FARTHEST = 4; // weights by which a score falls at most outside of a range
const PAINT = 1.25; // lead of what is painted over all others, as a multiple of what border effects can change

/**
 * The class function of a terrain.
 *
 * @param {ClassesEntry} entry @param {number} materials
 * @param {number} side of a tile
 * @param {HeightField} heights
 */
export function createClasses(entry, materials, side, heights) {
  const { jitter, rise } = entry, wave = 2 * jitter.amplitude, here = new Float64Array(materials);
  const painted = createPainted(LATTICE), weights = new Float64Array(materials), lead = paintLead(entry);
  for (const [i, j, length, m] of entry.painted ?? []) for (let k = 0; k < length; k++) painted.set(i + k, j, m);
  const rule = entry.rule.map((term) => (term.kind === "noise" ? { ...term, biases: [...term.biases] } : term));
  const addTerms = rule.map((term) => createTerm(term, { materials, side, heights, salt: entry.salt }));
  const jitterAt = createJitter(entry, materials), waves = new Float64Array(materials);
  const spare = new Float64Array(POINTS * POINTS * materials); // corners of one square
  /** @type {WeakMap<Float32Array, { material: number, squares: Uint8Array }>} */
  const squaresOf = new WeakMap(); // by the centres of a chunk
  let kept = new Uint32Array(0);
  const cells = createCellRing((i, j) => {
    const lattice = cellLattice(i, j), bits = findMaterials(lattice, materials, wave + rise.most);
    return { bits, lattice: bits & (bits - 1) ? lattice : null };
  });

  /**
   * Scores of all materials at a point of the lattice, `at` an index in `out`.
   *
   * @param {number} i @param {number} j @param {Float64Array} out @param {number} at
   */
  function latticeScores(i, j, out, at) {
    out.fill(0, at, at + materials);
    for (const add of addTerms) add(i, j, out, at);
    const sum = painted.weightsAt(i, j, weights);
    if (sum) applyPaint(out, at, weights, sum, lead);
  }

  /** @param {number} i @param {number} j @returns {Lattice} */
  function cellLattice(i, j) {
    const lattice = new Float64Array(POINTS * POINTS * materials);
    for (let b = 0, at = 0; b < POINTS; b++) {
      for (let a = 0; a < POINTS; a++, at += materials) latticeScores(i * LATTICE + a, j * LATTICE + b, lattice, at);
    }
    return lattice;
  }

  /**
   * Scores of all materials at a place of a cell, in tile sides from its corner; without jitter. The next call
   * overwrites them.
   *
   * @param {number} i @param {number} j @param {number} u @param {number} v
   */
  function scoresAt(i, j, u, v) {
    const a = squareOf(u), b = squareOf(v), { lattice } = cells.get(i, j);
    for (let k = 0; k < (lattice ? 0 : 4); k++) {
      const x = a + (k & 1), y = b + (k >> 1);
      latticeScores(i * LATTICE + x, j * LATTICE + y, spare, (y * POINTS + x) * materials);
    }
    return interpolate(lattice ?? spare, a, b, u * LATTICE - a, v * LATTICE - b);
  }

  /** @param {Lattice} lattice @param {number} a @param {number} b @param {number} s @param {number} t */
  function interpolate(lattice, a, b, s, t) {
    const south = (b * POINTS + a) * materials, north = south + POINTS * materials;
    for (let m = 0; m < materials; m++) {
      const sw = lattice[south + m], nw = lattice[north + m];
      const low = sw + s * (lattice[south + materials + m] - sw), high = nw + s * (lattice[north + materials + m] - nw);
      here[m] = low + t * (high - low);
    }
    return here;
  }

  /** Height of a Gaussian over the ground, or depth under it, less its clearance. @param {number} z @param {number} m */
  const heightOver = (z, m) => Math.abs(z - rise.ground[m]) - rise.clearance[m];

  /**
   * The square of the lattice under each Gaussian of a chunk, and LOW where it has no bonus: the same in all cells.
   *
   * @param {Float32Array} centres @param {number} material
   */
  function squaresUnder(centres, material) {
    const known = squaresOf.get(centres);
    if (known?.material === material) return known.squares;
    const squares = new Uint8Array(centres.length / 3);
    for (let k = 0; k < squares.length; k++) {
      const square = squareOf(centres[3 * k + 1] / side) * LATTICE + squareOf(centres[3 * k] / side);
      squares[k] = square + (heightOver(centres[3 * k + 2], material) > 0 ? 0 : LOW);
    }
    squaresOf.set(centres, { material, squares });
    return squares;
  }

  return {
    materials,
    amplitude: jitter.amplitude,
    painted,
    /** Compute a cell again: paint in it or beside it has changed. @param {number} i @param {number} j */
    forget: (i, j) => cells.forget(i, j),
    /** Add to the biases of the rule's noise, by material. @param {number[]} offsets */
    setOffsets(offsets) {
      rule.forEach((term, k) => {
        const { [k]: old } = entry.rule;
        if (term.kind !== "noise" || old.kind !== "noise") return;
        for (let m = 0; m < materials; m++) term.biases[m] = old.biases[m] + offsets[m];
      });
      cells.clear();
    },
    latticeScores,
    scoresAt,
    /** Jitter at a place of a cell. @param {number} i @param {number} j @param {number} u @param {number} v */
    jitterAt: (i, j, u, v) => jitterAt(i, j, u, v, waves),
    /**
     * Which materials may have a Gaussian in a cell: bit m for material m.
     *
     * @param {number} i @param {number} j
     */
    materialsIn: (i, j) => cells.get(i, j).bits,
    /**
     * Shares of a cell by material, without jitter: of the squares of its lattice, by the score in their middle.
     *
     * @param {number} i @param {number} j
     */
    sharesIn(i, j) {
      const { bits, lattice } = cells.get(i, j);
      return lattice ? measureShares(lattice, materials)
        : Float64Array.from({ length: materials }, (_, m) => (bits >> m) & 1);
    },
    /**
     * Indices of the Gaussians of a material's tile that stay in cell (i, j).
     *
     * @param {number} i @param {number} j @param {{ centres: Float32Array, count: number }} chunk
     * @param {number} material
     */
    keep(i, j, { centres, count }, material) {
      const lattice = cells.get(i, j).lattice ?? cellLattice(i, j), squares = squaresUnder(centres, material);
      const states = decideSquares(lattice, materials, material, wave, rise.most);
      if (kept.length < count) kept = new Uint32Array(2 * count);
      let n = 0;
      for (let k = 0; k < count; k++) {
        const square = squares[k] & (LATTICE * LATTICE - 1), state = states[squares[k]];
        if (state === GOES) continue;
        if (state === UNDECIDED) {
          const u = centres[3 * k] / side, v = centres[3 * k + 1] / side, a = square & 7, b = square >> 3;
          const scores = interpolate(lattice, a, b, u * LATTICE - a, v * LATTICE - b);
          const away = heightOver(centres[3 * k + 2], material);
          const bonus = Math.min(rise.slope * Math.max(away, 0), rise.most), lead = leadOf(scores, material, bonus);
          if (lead < -wave - SURE) continue;
          if (lead < wave + SURE && !isHighest(scores, jitterAt(i, j, u, v, waves), material, bonus)) continue;
        }
        kept[n++] = k;
      }
      return kept.slice(0, n);
    },
  };
}

/**
 * By how much the score of what is painted exceeds the others: just enough that nothing of them is left.
 *
 * @param {ClassesEntry} entry
 */
const paintLead = ({ jitter, rise }) => PAINT * (2 * jitter.amplitude + rise.most) || 1;

/**
 * By how much a material's score exceeds the highest of the others, without jitter.
 *
 * @param {Float64Array} scores @param {number} material @param {number} bonus
 */
function leadOf(scores, material, bonus) {
  let most = -Infinity;
  for (let m = 0; m < scores.length; m++) if (m !== material && scores[m] > most) most = scores[m];
  return scores[material] + bonus - most;
}

/**
 * Is a material's score the highest, with jitter?
 *
 * @param {Float64Array} scores @param {Float64Array} moved @param {number} material
 * @param {number} bonus
 */
function isHighest(scores, moved, material, bonus) {
  const own = scores[material] + moved[material] + bonus;
  for (let m = 0; m < scores.length; m++) if (m !== material && !(own >= scores[m] + moved[m])) return false;
  return true;
}

/**
 * A function that adds a term's scores of all materials at a lattice point.
 *
 * @param {Term} term
 * @param {{ materials: number, side: number, heights: HeightField, salt: number }} terrain
 * @returns {(i: number, j: number, out: Float64Array, at: number) => void}
 */
function createTerm(term, { materials, side, heights, salt }) {
  const { weight } = term, step = side / LATTICE;
  if (term.kind === "noise") {
    const noises = term.wavelengths.map((wavelength, m) => createClassNoise(wavelength, term.gains[m], m, salt));
    return (i, j, out, at) => {
      for (let m = 0; m < materials; m++) out[at + m] += weight * (noises[m](i, j) + term.biases[m]);
    };
  }
  const low = term.low ?? -Infinity, high = term.high ?? Infinity;
  return (i, j, out, at) => {
    const [height, east, north] = heights.at(i * step, j * step);
    const value = term.kind === "height" ? height : Math.sqrt(east * east + north * north);
    const outside = Math.max(Math.max(low - value, value - high), 0);
    out[at + term.material] += weight * -Math.min(outside / term.soft, FARTHEST);
  };
}

/**
 * Gradient noise of a material at lattice points, in [-1, 1].
 *
 * @param {number} wavelength @param {number[]} gains of the octaves @param {number} material @param {number} salt
 */
function createClassNoise(wavelength, gains, material, salt) {
  const step = 1 / (wavelength * LATTICE), total = gains.reduce((a, b) => a + b, 0);
  const noises = gains.map((_, k) => createNoise(NOISE + MAX_OCTAVES * material + k, salt));
  /** @param {number} i @param {number} j */
  return (i, j) => {
    let x = i * step, y = j * step, noise = 0;
    for (let k = 0; k < gains.length; k++) {
      const east = TURN[0] * x - TURN[1] * y, north = TURN[1] * x + TURN[0] * y;
      noise += gains[k] * noises[k](east + k * SHIFT[0], north + k * SHIFT[1]);
      x = 2 * east;
      y = 2 * north;
    }
    return noise / total;
  };
}
