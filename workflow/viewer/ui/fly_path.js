// Fly paths: places with the seconds at which they were passed; recorded while walking, played, saved as a file.

import { PageError } from "../data/errors.js";
import { moveTo, PLACE_KEYS } from "./walker.js";

/**
 * @typedef {import("./walker.js").Walker} Walker
 * @typedef {import("../terrain/camera.js").Place & { seconds: number }} TimedPlace
 * @typedef {"rest" | "record" | "play"} Mode
 * @typedef {ReturnType<typeof createFlyPath>} FlyPath
 */

const EVERY = 0.1; // seconds between recorded places

export function createFlyPath() {
  /** @type {TimedPlace[]} */
  let path = [];
  /** @type {Mode} */
  let mode = "rest";
  let clock = 0;

  /** @param {Walker} walker @param {number} seconds */
  const record = (walker, seconds) => {
    if (!path.length || clock + seconds - path[path.length - 1].seconds >= EVERY) {
      clock += path.length ? seconds : 0;
      const { x, y, eye, yaw, pitch } = walker;
      path.push({ seconds: clock, x, y, eye, yaw, pitch });
    } else clock += seconds;
  };

  return {
    get mode() {
      return mode;
    },
    get path() {
      return path;
    },
    record() {
      [path, mode, clock] = [[], "record", 0];
    },
    play() {
      if (path.length) [mode, clock] = ["play", 0];
    },
    stop() {
      mode = "rest";
    },
    /** Take a path from a file's JSON. Throws a PageError: it is none. @param {any} value */
    load(value) {
      const sound = value?.format === "davgswt-flight" && Array.isArray(value.path) && value.path.length > 0
        && value.path.every((/** @type {any} */ place, /** @type {number} */ k) =>
          ["seconds", ...PLACE_KEYS].every((key) => Number.isFinite(place?.[key]))
          && (k === 0 || place.seconds >= value.path[k - 1].seconds));
      if (!sound) throw new PageError("The dropped file is not a fly path. Drop one that “Save path” has saved.");
      [path, mode] = [value.path, "rest"];
    },
    toJSON: () => ({ format: "davgswt-flight", version: 1, path }),
    /**
     * Advance by some seconds: record the walker, or move it along the path. Returns: did the walker move?
     *
     * @param {Walker} walker
     * @param {number} seconds
     */
    step(walker, seconds) {
      if (mode === "record") record(walker, seconds);
      if (mode !== "play") return false;
      clock += seconds;
      moveTo(walker, placeAt(path, clock));
      if (clock >= path[path.length - 1].seconds) mode = "rest";
      return true;
    },
  };
}

/**
 * The place at a moment of a path, linear between recorded ones; a turn takes the shorter way.
 *
 * @param {TimedPlace[]} path
 * @param {number} seconds
 * @returns {import("../terrain/camera.js").Place}
 */
export function placeAt(path, seconds) {
  const k = path.findIndex((place) => place.seconds > seconds);
  if (k === 0) return path[0];
  if (k < 0) return path[path.length - 1];
  const a = path[k - 1], b = path[k], share = (seconds - a.seconds) / (b.seconds - a.seconds);
  /** @param {"x" | "y" | "eye" | "pitch"} key */
  const between = (key) => a[key] + share * (b[key] - a[key]);
  const turn = (((b.yaw - a.yaw + 540) % 360) + 360) % 360 - 180;
  return {
    x: between("x"), y: between("y"), eye: between("eye"), yaw: a.yaw + share * turn, pitch: between("pitch"),
  };
}
