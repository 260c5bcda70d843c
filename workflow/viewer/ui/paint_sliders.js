// Sliders of the panel of materials: densities of objects, shares of materials. Shares are set where the rule is noise
// alone, by offsets of its biases, as in fit_classes.py.

import { DENSITY_STEPS, MAX_DENSITY, MAX_OFFSET } from "../data/paint.js";
import { hashCell } from "../terrain/choice.js";
import { createClasses } from "../terrain/classes.js";
import { createHeights } from "../terrain/heights.js";
import { element } from "./dom.js";

/** @typedef {import("../data/manifest.js").Manifest} Manifest */

const SAMPLES = 3000, STEPS = 120; // of the search for offsets

/**
 * Add a slider. Returns: a function that brings it up to date.
 *
 * @param {HTMLElement} box
 * @param {{ name: string, most: number, step: number, read: () => number, format: (value: number) => string,
 *   write: (value: number, final: boolean) => void }} options final: it was let go
 */
function addSlider(box, { name, most, step, read, format, write }) {
  const label = document.createElement("label"), title = document.createElement("span");
  const input = document.createElement("input"), output = document.createElement("output");
  Object.assign(input, { type: "range", min: 0, max: most, step });
  [title.textContent, title.className] = [name, "name"];
  label.append(title, input, output);
  box.append(label);
  const refresh = () => {
    const value = read();
    output.textContent = format(value);
    if (document.activeElement !== input || Math.abs(Number(input.value) - value) > step) input.value = String(value);
  };
  input.addEventListener("input", () => write(Number(input.value), false));
  input.addEventListener("change", () => write(Number(input.value), true));
  return refresh;
}

/**
 * Sliders of objects' densities. Returns: functions that bring them up to date.
 *
 * @param {Manifest} manifest
 * @param {import("./painting.js").Painting} painting
 */
export function addDensities({ objects = [], materials }, painting) {
  const box = element("densities", HTMLElement);
  element("densityBox", HTMLElement).hidden = !objects.length;
  box.replaceChildren();
  return objects.map(({ name, material }, k) => addSlider(box, {
    name: materials.length > 1 ? `${name} on ${materials[material].name}` : name, most: MAX_DENSITY,
    step: 1 / DENSITY_STEPS, read: () => painting.densities[k], format: (v) => `${v.toFixed(2)}×`,
    write: (v, final) => painting.setDensity(k, v, final),
  }));
}

/**
 * Sliders of materials' shares, or why there are none.
 *
 * @param {Manifest} manifest
 * @param {import("./painting.js").Painting} painting
 */
export function addShares(manifest, painting) {
  const box = element("shares", HTMLElement), settable = areSettable(manifest);
  element("shareBox", HTMLElement).hidden = manifest.materials.length < 2;
  element("noShares", HTMLElement).hidden = settable;
  box.replaceChildren();
  if (!settable) return [];
  /** @type {ReturnType<typeof createShares> | null} */
  let shares = null;
  let known = painting.offsets, values = manifest.materials.map(({ share }) => share);
  const sum = values.reduce((all, v) => all + v, 0) || 1;
  values = values.map((v) => v / sum);
  const refresh = () => {
    const { offsets } = painting;
    if (offsets.every((v, m) => v === known[m])) return;
    shares ??= createShares(manifest);
    [known, values] = [offsets, shares.sharesOf(offsets)];
  };
  return manifest.materials.map(({ name }, m) => addSlider(box, {
    name, most: 1, step: 0.01, format: (v) => `${Math.round(100 * v)} %`,
    read: () => {
      refresh();
      return values[m];
    },
    write(v, final) {
      shares ??= createShares(manifest);
      const wanted = changeShare(values, m, v);
      painting.setOffsets(shares.offsetsFor(wanted), final);
      [known, values] = [painting.offsets, wanted];
    },
  }));
}

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
