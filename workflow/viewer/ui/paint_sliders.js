// Sliders of the panel of materials: densities of objects, shares of materials.

import { DENSITY_STEPS, MAX_DENSITY } from "../data/paint.js";
import { element } from "./dom.js";
import { areSettable, changeShare, createShares } from "./shares.js";

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
 * @param {import("../data/manifest.js").Manifest} manifest
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
 * @param {import("../data/manifest.js").Manifest} manifest
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
