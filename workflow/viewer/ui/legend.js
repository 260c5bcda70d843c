// The legend of an overlay: what its colours mean, and what is under the pointer.

import { uncertaintyRange } from "../data/uncertainty.js";
import { levelColour, materialColour, OBJECTS, OVERLAYS, SORTED, uncertaintyColour } from "../draw/overlays.js";
import { element, swatch } from "./dom.js";
import { unitName } from "./numbers.js";

/**
 * @typedef {import("../data/manifest.js").Manifest} Manifest
 * @typedef {{ tile: number, level: number | null, order: number | null }} Under what is under the pointer
 */

const STEPS = 7; // swatches of a scale

export function createLegend() {
  const box = element("legend", HTMLElement), value = document.createElement("p");
  /** @type {Manifest | null} */
  let shown = null;
  /** @param {string} text */
  const say = (text) => {
    if (value.textContent !== text) value.textContent = text;
  };
  return {
    /** Show the legend of an overlay; the picture as it is has none. @param {number} overlay @param {Manifest | null} manifest */
    show(overlay, manifest) {
      const name = OVERLAYS[overlay];
      shown = name === "picture" ? null : manifest;
      box.hidden = !shown;
      if (!shown) return;
      const list = document.createElement("ul");
      list.append(...entriesOf(name, shown).map(([colour, text]) => {
        const item = document.createElement("li");
        item.append(...colour ? [swatch(colour)] : [], text);
        return item;
      }));
      say(HINT);
      box.replaceChildren(list, value);
    },
    /** What is under the pointer; null: no ground. @param {Under | null} under */
    tell(under) {
      if (!shown) return;
      if (!under) return say("No tile here");
      const { tile, level, order } = under, uncertainty = shown.tiles[tile]?.uncertainty ?? 0;
      const parts = [`tile ${tile}`, `uncertainty ${uncertainty.toPrecision(2)}`];
      if (level !== null) parts.push(`level ${level}`);
      if (order !== null) parts.push(`order ${order}`);
      say(`Here: ${parts.join(", ")}`);
    },
  };
}

const HINT = "Point at the ground for its values";

/**
 * Colours and what they stand for.
 *
 * @param {string} name of an overlay
 * @param {Manifest} manifest
 * @returns {[number[] | null, string][]}
 */
function entriesOf(name, manifest) {
  if (name === "tile") return [[null, `A colour for each of ${manifest.tiles.length} tiles`]];
  if (name === "level") return manifest.levels.map(({ level, distance }) => [levelColour(level), levelText(manifest, level, distance)]);
  if (name === "order") {
    return [[SORTED, "sorted as seen from here"], [null, `else one of ${manifest.directions.length} orders that were sorted beforehand, a colour each`]];
  }
  if (name === "uncertainty") {
    const [low, high] = uncertaintyRange(manifest.tiles);
    if (low === high) return [[uncertaintyColour(0.5), `${low.toPrecision(2)}, all tiles alike`]];
    return Array.from({ length: STEPS }, (_, k) => {
      const text = k === 0 ? `${low.toPrecision(2)}, sure` : k === STEPS - 1 ? `${high.toPrecision(2)}, unsure` : "";
      return [uncertaintyColour(k / (STEPS - 1)), text];
    });
  }
  /** @type {[number[], string][]} */
  const named = manifest.materials.map((material, m) => [materialColour(m), material.name]);
  return manifest.objects?.length ? [...named, [materialColour(OBJECTS), "objects"]] : named;
}

/** @param {Manifest} manifest @param {number} level @param {number | null} distance */
function levelText({ levels, unit }, level, distance) {
  if (distance !== null) return `level ${level}${level ? "" : ", finest"}: up to ${Number(distance.toPrecision(2))} ${unitName(unit)}`;
  return `level ${level}${levels.length > 1 ? ": beyond" : ""}`;
}
