// The tour: a flight over the terrain without anybody at the controls. It winds, sinks and rises slowly, stays above what
// lies ahead, and goes on until somebody touches anything.

import { element, listenToKeys } from "./dom.js";
import { goBy, moveTo } from "./walker.js";

/**
 * @typedef {import("./walker.js").Walker} Walker
 * @typedef {{ at: (x: number, y: number) => number[] }} Surface
 */

const LOW = 1.3, HIGH = 5; // heights over the ground ahead, in lowest eyes
const BREATH = 41; // seconds from one low pass to the next
const WIND = [[7, 29], [4, 67]]; // turns to and fro: degrees a second at most, and seconds of one
const SPEED = 0.45; // heights a second
const PITCH = [-8, -14]; // degrees above the horizon, low and high
const EASE = 5; // seconds until the tour has its own height, pitch and speed
const AHEAD = [0, 1.5, 3, 4.5, 6]; // seconds of the way ahead whose ground the height minds
const SETTLE = 1.2; // seconds in which the height comes nearly all the way to where it belongs
const MAX_STEP = 0.25; // seconds that a late frame makes up for

export function createTour() {
  let on = false, clock = 0, z = 0, climb = 0;
  const begin = { pitch: 0, above: 0 };
  return {
    get on() {
      return on;
    },
    /** Begin at the walker's place. @param {Walker} walker @param {Surface} surface */
    start(walker, surface) {
      [on, clock, climb, z] = [true, 0, 0, surface.at(walker.x, walker.y)[0] + walker.eye];
      Object.assign(begin, { pitch: walker.pitch, above: walker.eye });
    },
    stop() {
      on = false;
    },
    /**
     * Go on for some seconds. Returns: did the walker move?
     *
     * @param {Walker} walker @param {Surface} surface @param {number} seconds
     */
    step(walker, surface, seconds) {
      if (!on) return false;
      const step = Math.min(seconds, MAX_STEP), share = smooth(Math.min(1, clock / EASE));
      clock += step;
      const height = 0.5 - 0.5 * Math.cos((2 * Math.PI * clock) / BREATH);
      const wanted = walker.floor * LOW * (HIGH / LOW) ** height, above = begin.above ** (1 - share) * wanted ** share;
      const speed = SPEED * above * share, yaw = (walker.yaw * Math.PI) / 180;
      const turn = WIND.reduce((sum, [most, period]) => sum + most * Math.sin((2 * Math.PI * clock) / period), 0);
      const way = AHEAD.map((later) => surface.at(
        walker.x + later * speed * Math.cos(yaw), walker.y + later * speed * Math.sin(yaw))[0]);
      rise(Math.max(...way) + above, step);
      goBy(walker, step * speed * Math.cos(yaw), step * speed * Math.sin(yaw));
      const [ground] = surface.at(walker.x, walker.y);
      z = Math.max(z, ground + walker.floor);
      moveTo(walker, {
        eye: z - ground, yaw: walker.yaw + turn * share * step,
        pitch: begin.pitch + share * (PITCH[0] + height * (PITCH[1] - PITCH[0]) - begin.pitch),
      });
      return true;
    },
  };

  /** A critically damped spring. @param {number} goal @param {number} step */
  function rise(goal, step) {
    const stiff = 4 / SETTLE, away = z - goal, fade = Math.exp(-stiff * step), push = (climb + stiff * away) * step;
    z = goal + (away + push) * fade;
    climb = (climb - stiff * push) * fade;
  }
}

/** From 0 to 1 with no jolt at either end. @param {number} t */
const smooth = (t) => t * t * (3 - 2 * t);

/**
 * The tour's button and key. Any input ends it. `?tour` in the address begins it, except where the
 * system asks for less motion.
 *
 * @param {import("./viewer.js").Viewer} viewer @param {() => void} closePanels
 */
export function listenToTour(viewer, closePanels) {
  const { tour, hud } = viewer, button = element("tour", HTMLButtonElement);
  const stop = () => {
    if (!tour.on) return;
    tour.stop();
    hud.say("The tour ends here: walk on.");
  };
  const start = () => {
    const { scene } = viewer;
    if (!scene) return;
    tour.start(scene.walker, scene.heights);
    closePanels();
    hud.say("A tour. Any key or touch ends it.");
  };
  button.addEventListener("click", start); // which no pointer reaches without ending the last one
  for (const kind of ["keydown", "pointerdown", "wheel", "drop"]) {
    const end = (/** @type {Event} */ event) => {
      if (!(event instanceof KeyboardEvent && event.code === "KeyT")) stop(); // its own key ends it below
    };
    addEventListener(kind, end, { capture: true, passive: true });
  }
  listenToKeys({ KeyT: () => (tour.on ? stop() : start()) });
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (new URLSearchParams(location.search).has("tour") && !calm) start();
}
