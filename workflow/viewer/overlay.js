// Overlays: what the splats' colours say instead of what is there.

import { NO_ORDER } from "./runs.js";

export const OVERLAYS = ["picture", "tile", "level", "order", "uncertainty"];

const COOL = [0.23, 0.3, 0.75], LIGHT = [0.87, 0.86, 0.85], WARM = [0.71, 0.02, 0.15]; // uncertainty, low to high
const SORTED = [0.95, 0.95, 0.95]; // cells that are sorted exactly have no order

/** 256 colours (of 4 bytes each) by the number that an overlay shows, see the vertex shader. */
export function huesOf(overlay, { directions }) {
  const colours = Array.from({ length: 256 }, (_, n) => {
    if (OVERLAYS[overlay] === "tile") return wheel(n * 0.618034);
    if (OVERLAYS[overlay] === "level") return wheel(0.33 - (n / 32) * 0.13);
    if (OVERLAYS[overlay] === "order") return n === NO_ORDER ? SORTED : wheel(n / Math.max(1, directions.length));
    return n < 128 ? mixed(COOL, LIGHT, n / 127.5) : mixed(LIGHT, WARM, n / 127.5 - 1);
  });
  return Uint8Array.from(colours.flatMap((colour) => [...colour.map((v) => Math.round(255 * v)), 255]));
}

const mixed = (a, b, share) => a.map((v, k) => v + share * (b[k] - v));

/** A colour of the wheel; turn 0 is red, 1/3 green, 2/3 blue. */
function wheel(turn) {
  const t = ((turn % 1) + 1) % 1;
  return [0, 1, 2].map((k) => {
    const far = Math.abs(((t - k / 3 + 1.5) % 1) - 0.5);
    return Math.min(Math.max(2 - 6 * far, 0), 1) * 0.85 + 0.1;
  });
}
