// Overlays: colours that show tiles, levels, orders, uncertainty or materials instead of the picture.

import { NO_ORDER } from "../data/layout.js";

export const OVERLAYS = ["picture", "tile", "level", "order", "uncertainty", "material"];
export const TITLES = ["Terrain", "Tiles", "Levels of detail", "Drawing orders", "Uncertainty", "Materials"];
export const OBJECTS = 255; // number of objects in the overlay of materials

const COOL = [0.23, 0.3, 0.75], LIGHT = [0.87, 0.86, 0.85], WARM = [0.71, 0.02, 0.15]; // uncertainty, low to high
const MATERIALS = [ // told apart by people of all kinds of colour vision; after Okabe and Ito
  [0.9, 0.62, 0], [0, 0.62, 0.45], [0.34, 0.71, 0.91], [0.8, 0.4, 0], [0.94, 0.89, 0.26], [0, 0.45, 0.7],
  [0.8, 0.47, 0.65], [0.25, 0.25, 0.25],
];
const STANDING = [0.97, 0.97, 0.97]; // objects
const LEVELS = [ // from fine to coarse: light to dark, after viridis
  [0.99, 0.91, 0.14], [0.48, 0.82, 0.32], [0.13, 0.66, 0.52], [0.16, 0.47, 0.56], [0.26, 0.28, 0.53], [0.27, 0.0, 0.33],
  [0.45, 0.1, 0.35], [0.65, 0.25, 0.4],
];
export const SORTED = [0.95, 0.95, 0.95]; // cells that are sorted by depth have no order

/**
 * 256 colours of 4 bytes, by the number that an overlay shows (see the vertex shader).
 *
 * @param {number} overlay @param {import("../data/manifest.js").Manifest} manifest
 */
export function overlayColours(overlay, { directions }) {
  const colours = Array.from({ length: 256 }, (_, n) => {
    if (OVERLAYS[overlay] === "tile") return tileColour(n);
    if (OVERLAYS[overlay] === "level") return levelColour(n >> 5);
    if (OVERLAYS[overlay] === "order") return n === NO_ORDER ? SORTED : hue(n / Math.max(1, directions.length));
    if (OVERLAYS[overlay] === "material") return materialColour(n);
    return uncertaintyColour(n / 255);
  });
  return Uint8Array.from(colours.flatMap((colour) => [...colour.map((v) => Math.round(255 * v)), 255]));
}

/** The colour of a material in its overlay, 0 to 1; OBJECTS: that of objects. @param {number} m */
export const materialColour = (m) => (m === OBJECTS ? STANDING : MATERIALS[m % MATERIALS.length]);

/** The colour of a tile. @param {number} tile */
export const tileColour = (tile) => hue(tile * 0.618034);

/** The colour of a level of detail. @param {number} level */
export const levelColour = (level) => LEVELS[level % LEVELS.length];

/** The colour of an uncertainty. @param {number} share of the range of the set, 0 to 1 */
export const uncertaintyColour = (share) => (share < 0.5 ? mix(COOL, LIGHT, 2 * share) : mix(LIGHT, WARM, 2 * share - 1));

/** @param {number[]} a @param {number[]} b @param {number} share */
const mix = (a, b, share) => a.map((v, k) => v + share * (b[k] - v));

/** A colour of the wheel; turn 0 is red, 1/3 green, 2/3 blue. @param {number} turn */
function hue(turn) {
  const t = ((turn % 1) + 1) % 1;
  return [0, 1, 2].map((k) => {
    const far = Math.abs(((t - k / 3 + 1.5) % 1) - 0.5);
    return Math.min(Math.max(2 - 6 * far, 0), 1) * 0.85 + 0.1;
  });
}
