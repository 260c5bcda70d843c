// Controls of the walker: keys, mouse, wheel, touch and the pad.

import { FIELD_OF_VIEW } from "../terrain/camera.js";
import { isField } from "./dom.js";
import { goBy, moveTo } from "./walker.js";

/**
 * @typedef {import("./walker.js").Walker} Walker
 * @typedef {import("./orbit.js").Orbit} Orbit
 * @typedef {number[]} Point x, y in CSS pixels
 */

/** @type {Record<string, import("./walker.js").Action>} */
const KEYS = {
  KeyW: "forward", ArrowUp: "forward", KeyS: "back", ArrowDown: "back", KeyA: "left", KeyD: "right",
  ArrowLeft: "turnLeft", ArrowRight: "turnRight", KeyQ: "lower", KeyE: "higher", ShiftLeft: "run", ShiftRight: "run",
};
const ARROWS = /^Arrow/; // keys that lists and sliders need themselves
const WHEEL_PIXELS = [1, 16, 400]; // by deltaMode: pixels, lines, pages

/**
 * Let a person move the walker; onChange is called after each change that needs a picture.
 *
 * @param {Walker} walker
 * @param {Orbit} orbit
 * @param {HTMLElement} canvas
 * @param {HTMLElement} pad
 * @param {Pick<import("./paint_brush.js").Brush, "begin" | "move" | "end" | "cancel">} brush may take pointers
 * @param {() => void} onChange
 */
export function listenToControls(walker, orbit, canvas, pad, brush, onChange) {
  addEventListener("keydown", (event) => {
    const action = KEYS[event.code];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    if (ARROWS.test(event.code) && isField(event.target)) return;
    if (action !== "run") event.preventDefault();
    walker.held.add(action);
    onChange();
  });
  addEventListener("keyup", (event) => walker.held.delete(KEYS[event.code]));
  addEventListener("blur", () => walker.held.clear());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const pixels = event.deltaY * WHEEL_PIXELS[event.deltaMode];
    const factor = Math.exp(Math.min(Math.max(pixels, -200), 200) / 500);
    if (walker.mode === "orbit") orbit.zoom(factor);
    else moveTo(walker, { eye: walker.eye * factor });
    onChange();
  }, { passive: false });
  listenToPointers(walker, orbit, canvas, brush, onChange);
  pad.addEventListener("pointerdown", (event) => {
    pad.setPointerCapture(event.pointerId);
    walker.held.add("forward");
    onChange();
  });
  for (const end of ["pointerup", "pointercancel"]) pad.addEventListener(end, () => walker.held.delete("forward"));
}

/**
 * One pointer turns the view, as if the picture were held, unless the brush takes it; two fingers walk (drag) and change
 * height (pinch).
 *
 * @param {Walker} walker
 * @param {Orbit} orbit
 * @param {HTMLElement} canvas
 * @param {Pick<import("./paint_brush.js").Brush, "begin" | "move" | "end" | "cancel">} brush
 * @param {() => void} onChange
 */
function listenToPointers(walker, orbit, canvas, brush, onChange) {
  /** @type {Map<number, Point>} */
  const down = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, [event.clientX, event.clientY]);
    if (down.size > 1) brush.cancel();
    else brush.begin(event);
  });
  /** @param {PointerEvent} event */
  const release = (event) => {
    brush.end(event);
    down.delete(event.pointerId);
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("pointermove", (event) => {
    const painted = brush.move(event), from = down.get(event.pointerId);
    if (painted || !from) return;
    const to = [event.clientX, event.clientY], size = Math.max(canvas.clientWidth, canvas.clientHeight);
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    down.set(event.pointerId, to);
    if (other) moveByTwoFingers(walker, from, to, other, size);
    else if (walker.mode === "orbit") {
      orbit.turn((180 * (from[0] - to[0])) / size, (180 * (from[1] - to[1])) / size);
    } else {
      const degrees = (walker.fieldOfView ?? FIELD_OF_VIEW) / size;
      moveTo(walker, {
        yaw: walker.yaw + degrees * (to[0] - from[0]), pitch: walker.pitch + degrees * (to[1] - from[1]),
      });
    }
    onChange();
  });
}

/**
 * @param {Walker} walker
 * @param {Point} from of the finger that moved
 * @param {Point} to
 * @param {Point} other the other finger
 * @param {number} size of the canvas
 */
function moveByTwoFingers(walker, from, to, other, size) {
  /** @param {Point} a */
  const apart = (a) => Math.max(20, Math.hypot(a[0] - other[0], a[1] - other[1]));
  const yaw = (walker.yaw * Math.PI) / 180, scale = (4 * walker.eye) / size;
  const forward = scale * (to[1] - from[1]), left = scale * (to[0] - from[0]);
  goBy(walker, forward * Math.cos(yaw) - left * Math.sin(yaw), forward * Math.sin(yaw) + left * Math.cos(yaw));
  moveTo(walker, { eye: (walker.eye * apart(from)) / apart(to) });
}
