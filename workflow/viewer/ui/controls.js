// Controls of the walker: keys, mouse, wheel, touch and the pad; and orbiting.

import { FIELD_OF_VIEW, hitGround } from "../terrain/camera.js";
import { isField } from "./dom.js";
import { goBy, moveTo } from "./walker.js";

/**
 * @typedef {import("./walker.js").Walker} Walker
 * @typedef {import("./paint_brush.js").Brush} Brush
 * @typedef {ReturnType<typeof createOrbit>} Orbit
 * @typedef {number[]} Point x, y in CSS pixels
 */

/** @type {Record<string, import("./walker.js").Action>} */
const KEYS = {
  KeyW: "forward", ArrowUp: "forward", KeyS: "back", ArrowDown: "back", KeyA: "left", KeyD: "right",
  ArrowLeft: "turnLeft", ArrowRight: "turnRight", KeyQ: "lower", KeyE: "higher", ShiftLeft: "run", ShiftRight: "run",
};
const ARROWS = /^Arrow/; // keys that lists and sliders need themselves
const WHEEL_PIXELS = [1, 16, 400]; // by deltaMode: pixels, lines, pages
const FARTHEST = 24; // tile sides to what is orbited; beyond, or in the sky, a place at AHEAD of them is
const AHEAD = 4;
const STEEPEST = -89, FLATTEST = -4; // degrees above the horizon of an orbit

/**
 * Let a person move the walker; onChange is called after each change that needs a picture.
 *
 * @param {Walker} walker @param {Orbit} orbit @param {HTMLElement} canvas @param {HTMLElement} pad
 * @param {Pick<Brush, "begin" | "move" | "end" | "cancel">} brush may take pointers
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
 * @param {Walker} walker @param {Orbit} orbit @param {HTMLElement} canvas
 * @param {Pick<Brush, "begin" | "move" | "end" | "cancel">} brush @param {() => void} onChange
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
      const degrees = FIELD_OF_VIEW / size;
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

/**
 * Orbiting: the eye turns about the place that the middle of the picture shows, and comes nearer to it.
 *
 * @param {Pick<import("./viewer.js").Viewer, "scene" | "camera">} viewer
 */
export function createOrbit(viewer) {
  /** What is orbited: x, y, z, and its distance from the eye. */
  const findPivot = () => {
    const { scene } = viewer;
    if (!scene) return null;
    const { eye, ahead } = viewer.camera(scene), { heights, lift, manifest: { tile_side: side } } = scene;
    const hit = hitGround(eye, ahead, heights, { lift, farthest: FARTHEST * side });
    const place = hit ? [...hit, heights.at(hit[0], hit[1])[0] + lift] : eye.map((v, k) => v + AHEAD * side * ahead[k]);
    return { place, far: Math.hypot(...place.map((v, k) => v - eye[k])) };
  };
  /** @param {number[]} place @param {number} far @param {number} yaw @param {number} pitch */
  const look = (place, far, yaw, pitch) => {
    const { scene } = viewer;
    if (!scene) return;
    const [a, b] = [yaw, pitch].map((v) => (v * Math.PI) / 180);
    const x = place[0] - far * Math.cos(b) * Math.cos(a), y = place[1] - far * Math.cos(b) * Math.sin(a);
    moveTo(scene.walker, { x, y, eye: place[2] - far * Math.sin(b) - scene.heights.at(x, y)[0], yaw, pitch });
  };
  return {
    /** Turn by degrees. @param {number} turn @param {number} tilt */
    turn(turn, tilt) {
      const walker = viewer.scene?.walker;
      if (walker?.radius) return rollPlanet(walker, turn, tilt);
      const pivot = findPivot();
      if (!pivot || !walker) return;
      const pitch = Math.min(Math.max(walker.pitch + tilt, STEEPEST), Math.max(FLATTEST, walker.pitch));
      look(pivot.place, pivot.far, walker.yaw + turn, pitch);
    },
    /** Change the distance. @param {number} factor */
    zoom(factor) {
      const walker = viewer.scene?.walker;
      if (walker?.radius) return moveTo(walker, { eye: walker.eye * factor });
      const pivot = findPivot();
      if (pivot && walker) look(pivot.place, pivot.far * factor, walker.yaw, walker.pitch);
    },
  };
}

/**
 * Turn a planet under the eye, as if the ground were held: slowly near it, at most once around for 180 degrees.
 *
 * @param {import("./walker.js").Walker} walker
 * @param {number} turn degrees
 * @param {number} tilt
 */
function rollPlanet(walker, turn, tilt) {
  const yaw = (walker.yaw * Math.PI) / 180, unit = (Math.min(walker.eye, 2 * walker.radius) * Math.PI) / 180;
  const ahead = -tilt * unit, right = turn * unit;
  goBy(walker, ahead * Math.cos(yaw) + right * Math.sin(yaw), ahead * Math.sin(yaw) - right * Math.cos(yaw));
}
