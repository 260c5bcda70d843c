// Overlays: colours that show tiles, levels, orders or uncertainty instead of the picture.

import { NO_ORDER } from "../data/layout.js";

export const OVERLAYS = ["picture", "tile", "level", "order", "uncertainty"];

const COOL = [0.23, 0.3, 0.75], LIGHT = [0.87, 0.86, 0.85], WARM = [0.71, 0.02, 0.15]; // uncertainty, low to high
const SORTED = [0.95, 0.95, 0.95]; // cells that are sorted by depth have no order

/**
 * 256 colours of 4 bytes, by the number that an overlay shows (see the vertex shader).
 *
 * @param {number} overlay
 * @param {import("../data/manifest.js").Manifest} manifest
 */
export function overlayColours(overlay, { directions }) {
  const colours = Array.from({ length: 256 }, (_, n) => {
    if (OVERLAYS[overlay] === "tile") return hue(n * 0.618034);
    if (OVERLAYS[overlay] === "level") return hue(0.33 - (n / 32) * 0.13);
    if (OVERLAYS[overlay] === "order") return n === NO_ORDER ? SORTED : hue(n / Math.max(1, directions.length));
    return n < 128 ? mix(COOL, LIGHT, n / 127.5) : mix(LIGHT, WARM, n / 127.5 - 1);
  });
  return Uint8Array.from(colours.flatMap((colour) => [...colour.map((v) => Math.round(255 * v)), 255]));
}

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
