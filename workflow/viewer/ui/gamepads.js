// Gamepads: the left stick walks, the right one looks, the triggers change the eye's height, a shoulder runs.

import { moveBy } from "./walker.js";

const DEAD = 0.15; // of a stick's way, in which it rests
const SHOULDER = 5, LOWER = 6, HIGHER = 7; // buttons of the standard layout

/** @param {number | undefined} way -1 to 1 */
const push = (way = 0) => (Math.abs(way) < DEAD ? 0 : (way - Math.sign(way) * DEAD) / (1 - DEAD));

export function createGamepads() {
  let any = false; // asking costs a little, and few have one
  addEventListener("gamepadconnected", () => (any = true));
  return {
    /**
     * Move as the gamepads want for some seconds. Returns: did anything change?
     *
     * @param {import("./walker.js").Walker} walker
     * @param {number} seconds
     */
    step(walker, seconds) {
      if (!any) return false;
      let moved = false;
      for (const pad of navigator.getGamepads()) {
        if (!pad?.connected || pad.mapping !== "standard") continue; // of others nobody knows which axes rest at 0
        const [x, y, turn, tilt] = pad.axes, value = (/** @type {number} */ k) => pad.buttons[k]?.value ?? 0;
        const wish = {
          forward: -push(y), right: push(x), turn: -push(turn), tilt: -push(tilt),
          rise: push(value(HIGHER)) - push(value(LOWER)), run: Number(value(SHOULDER) > 0.5),
        };
        moved = moveBy(walker, wish, seconds) || moved;
      }
      return moved;
    },
  };
}
