// The walker: where the eye is, and how held keys move it. Angles in degrees.

import { walkOn } from "../terrain/sphere.js";

const SPEED = 1.2; // eye heights a second
const RUN = 4; // with Shift
const TURN = 70; // degrees a second with the arrow keys
const RISE = 1.2; // powers of e a second with Q and E
const CEILING = 16; // highest eye, in tile sides
const ORBIT = 4; // highest eye over a planet, in radii
const START = { x: 20, y: 30 }; // longitude and latitude that places on a planet count from
const YAW = 60;
const FARTHEST = 1e12; // coordinates beyond have no whole tiles left in double precision

/**
 * @typedef {import("../terrain/camera.js").Place} Place
 * @typedef {"forward" | "back" | "left" | "right" | "turnLeft" | "turnRight" | "lower" | "higher" | "run"} Action
 *
 * walk: over the ground, at one height; fly: where one looks; orbit: dragging turns about what one looks at.
 * @typedef {"walk" | "fly" | "orbit"} Mode
 *
 * A place, the bounds of the eye's height above the surface, and the actions of held keys; radius: of the planet, 0 on a
 * plane.
 * @typedef {Place & { floor: number, ceiling: number, held: Set<Action>, mode: Mode, radius: number }} Walker
 */

/** @type {Mode[]} */
export const MODES = ["walk", "fly", "orbit"];

export const PLACE_KEYS = /** @type {const} */ (["x", "y", "eye", "yaw", "pitch"]);

/**
 * @param {Pick<import("../data/manifest.js").Manifest, "tile_side" | "eye_floor" | "heights">} manifest
 * @param {Partial<Place>} [place]
 * @returns {Walker}
 */
export function createWalker({ tile_side: side, eye_floor: floor, heights }, place = {}) {
  const radius = heights?.kind === "sphere" ? heights.radius : 0, half = side / 2;
  const walker = {
    x: half, y: half, yaw: YAW, ...(radius ? walkOn({ ...START, yaw: YAW }, half, half, radius) : {}), // the stills' walker
    eye: floor, pitch: -12, radius,
    floor, ceiling: Math.max(CEILING * side, 4 * floor, ORBIT * radius), held: new Set(),
    mode: /** @type {Mode} */ ("walk"),
  };
  moveTo(walker, place);
  return walker;
}

/**
 * Change any parts of the place, within bounds; what is not a finite number, or beyond all bounds, stays as it was.
 *
 * @param {Walker} walker @param {Partial<Place>} place
 */
export function moveTo(walker, place) {
  for (const key of PLACE_KEYS) {
    const value = place[key];
    if (value !== undefined && Math.abs(value) <= FARTHEST) walker[key] = value;
  }
  walker.eye = Math.min(Math.max(walker.eye, walker.floor), walker.ceiling);
  walker.pitch = Math.min(Math.max(walker.pitch, -90), 90);
  if (walker.radius) walker.y = Math.min(Math.max(walker.y, -90), 90);
  walker.yaw = ((walker.yaw % 360) + 360) % 360;
}

/**
 * Move by the held keys for some seconds. Returns: did anything change?
 *
 * @param {Walker} walker @param {number} seconds
 */
export function stepWalker(walker, seconds) {
  /** @param {Action} more @param {Action} less */
  const push = (more, less) => Number(walker.held.has(more)) - Number(walker.held.has(less));
  const forward = push("forward", "back"), right = push("right", "left");
  const turn = push("turnLeft", "turnRight"), rise = push("higher", "lower");
  if (!forward && !right && !turn && !rise) return false;
  const yaw = (walker.yaw * Math.PI) / 180, pitch = walker.mode === "fly" ? (walker.pitch * Math.PI) / 180 : 0;
  const speed = SPEED * walker.eye * (walker.held.has("run") ? RUN : 1);
  const stride = (speed * seconds) / Math.max(1, Math.hypot(forward, right)), along = forward * Math.cos(pitch);
  const east = along * Math.cos(yaw) + right * Math.sin(yaw), north = along * Math.sin(yaw) - right * Math.cos(yaw);
  goBy(walker, stride * east, stride * north);
  moveTo(walker, {
    yaw: walker.yaw + turn * TURN * seconds,
    eye: walker.eye * Math.exp(rise * RISE * seconds) + stride * forward * Math.sin(pitch),
  });
  return true;
}

/**
 * Go straight on; over a planet along a great circle, on which where one looks turns with the meridians.
 *
 * @param {Walker} walker
 * @param {number} east world units
 * @param {number} north
 */
export function goBy(walker, east, north) {
  if (walker.radius) moveTo(walker, walkOn(walker, east, north, walker.radius));
  else moveTo(walker, { x: walker.x + east, y: walker.y + north });
}
