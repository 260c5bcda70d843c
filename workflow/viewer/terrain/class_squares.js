// Squares of a cell's lattice of scores: which materials may lie in each, and what happens to their Gaussians there.
// Part of classes.js.

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
