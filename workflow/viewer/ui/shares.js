// Shares of materials where the rule is noise alone: offsets of its biases that give them. As in fit_classes.py.

import { MAX_OFFSET } from "../data/paint.js";
import { hashCell } from "../terrain/choice.js";
import { createClasses } from "../terrain/classes.js";
import { createHeights } from "../terrain/heights.js";

/** @typedef {import("../data/manifest.js").Manifest} Manifest */

const SAMPLES = 3000, STEPS = 120;

/** Can shares be set? Other terms fix places, so noise has not all of the ground. @param {Manifest} manifest */
export const areSettable = ({ classes }) => classes?.rule.length === 1 && classes.rule[0].kind === "noise"
  && classes.rule[0].weight > 0;

/**
 * Shares of a rule of noise, measured in samples of it.
 *
 * @param {Manifest} manifest whose shares are settable
 */
export function createShares({ classes, materials, tile_side: side }) {
  if (!classes) throw new TypeError("one material has all of the ground");
  const n = materials.length, rule = createClasses({ ...classes, painted: [] }, n, side, createHeights());
  const scores = new Float64Array(SAMPLES * n), term = classes.rule[0], counts = new Float64Array(n);
  for (let k = 0; k < SAMPLES; k++) {
    rule.latticeScores(hashCell(k, 0, 0, 1) | 0, hashCell(k, 1, 0, 1) | 0, scores, k * n);
  }

  /** @param {number[]} offsets */
  function sharesOf(offsets) {
    counts.fill(0);
    for (let k = 0; k < SAMPLES; k++) {
      let best = 0;
      for (let m = 1; m < n; m++) {
        if (scores[k * n + m] + term.weight * offsets[m] > scores[k * n + best] + term.weight * offsets[best]) best = m;
      }
      counts[best] += 1 / SAMPLES;
    }
    return [...counts];
  }

  return {
    sharesOf,
    /** The offsets that give the wanted shares; a share of 0 has the lowest. @param {number[]} wanted */
    offsetsFor(wanted) {
      const offsets = wanted.map(() => 0);
      for (let step = 0; step < STEPS; step++) {
        const reached = sharesOf(offsets.map((v, m) => (wanted[m] > 0 ? v : -MAX_OFFSET)));
        for (let m = 0; m < n; m++) offsets[m] += ((wanted[m] - reached[m]) / (1 + 0.1 * step)) / term.weight;
      }
      const mean = offsets.reduce((sum, v) => sum + v, 0) / n;
      return offsets.map((v, m) => (wanted[m] > 0 ? v - mean : -MAX_OFFSET));
    },
  };
}

/**
 * Shares after one is changed: the others keep their proportions.
 *
 * @param {number[]} shares
 * @param {number} which
 * @param {number} value 0 to 1
 */
export function changeShare(shares, which, value) {
  const rest = shares.reduce((sum, share, m) => sum + (m === which ? 0 : share), 0), others = shares.length - 1;
  return shares.map((share, m) => (
    m === which ? value : rest > 0 ? (share * (1 - value)) / rest : (1 - value) / others));
}
