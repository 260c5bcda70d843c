// The camera of an eye on the terrain, and where rays from it meet the ground.

import { dot, frameAt } from "./sphere.js";

/**
 * Angles in degrees: yaw from east, counter-clockwise; pitch above the level. eye: height above the surface. On a sphere
 * x and y are longitude and latitude in degrees. fieldOfView: of the picture's longer side (default: FIELD_OF_VIEW).
 * @typedef {{ x: number, y: number, eye: number, yaw: number, pitch: number, fieldOfView?: number }} Place
 *
 * Position and axes in the world; size and focal length in pixels.
 * @typedef {{ eye: number[], right: number[], up: number[], ahead: number[], width: number, height: number,
 *   focal: number }} Camera
 */

export const FIELD_OF_VIEW = 60; // of the picture's longer side, degrees
const NEAREST = 1e-6; // depth of what is before the eye
const LEAST = 1e-3; // of the distance so far: a shorter step would take too many
const FIRST = 1e-5; // of the whole way: the same where the ray begins
const HALVINGS = 40; // of the step in which the ray comes down

/**
 * The camera of an eye at a place, for a picture of this size.
 *
 * @param {Place} place @param {number} width @param {number} height
 * @param {import("./heights.js").HeightField} [heights]
 * @returns {Camera}
 */
export function cameraAt(place, width, height, heights) {
  const yaw = (place.yaw * Math.PI) / 180, pitch = (place.pitch * Math.PI) / 180;
  const half = ((place.fieldOfView ?? FIELD_OF_VIEW) * Math.PI) / 360;
  const [c, s, p, q] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  if (heights?.kind === "sphere") {
    const frame = frameAt(place.x, place.y), { radius } = heights, flat = cameraAt({ ...place, x: 0, y: 0 }, width, height);
    /** @param {number[]} axis */
    const turn = (axis) => frame[0].map((_, k) => axis[0] * frame[0][k] + axis[1] * frame[1][k] + axis[2] * frame[2][k]);
    const [right, up, ahead] = [flat.right, flat.up, flat.ahead].map(turn);
    return { ...flat, eye: frame[2].map((v) => (radius + place.eye) * v), right, up, ahead };
  }
  return {
    eye: [place.x, place.y, place.eye + (heights ? heights.at(place.x, place.y)[0] : 0)],
    right: [s, -c, 0], up: [-q * c, -q * s, p], ahead: [p * c, p * s, q],
    width, height, focal: Math.max(width, height) / 2 / Math.tan(half),
  };
}

/**
 * The direction of a ray through a point of the picture.
 *
 * @param {Camera} camera
 * @param {number} across from the left edge to the right, 0 to 1
 * @param {number} down from the upper edge to the lower, 0 to 1
 */
export function rayThrough({ right, up, ahead, width, height, focal }, across, down) {
  const x = ((across - 0.5) * width) / focal, y = ((0.5 - down) * height) / focal, long = Math.hypot(1, x, y);
  return [0, 1, 2].map((k) => (ahead[k] + x * right[k] + y * up[k]) / long);
}

/**
 * The place (longitude and latitude on a sphere) where a ray first comes down to the ground; null: it does not within `farthest`.
 *
 * Each step goes as far as no slope of the surface could reach it, but no less than a thousandth of the distance, so that
 * one steep place elsewhere does not stop the ray; the step that ends below the ground is halved. A crest that the ray
 * passes through in less than such a step may be missed.
 *
 * @param {number[]} eye
 * @param {number[]} way of length 1
 * @param {import("./heights.js").HeightField} heights
 * @param {{ lift: number, farthest: number }} ground lift: height of the ground of tiles above the surface; farthest: finite
 * @returns {[number, number] | null}
 */
export function hitGround(eye, way, heights, { lift, farthest }) {
  if (heights.kind === "sphere") return hitSphere(eye, way, heights.radius + lift);
  const fall = Math.max(heights.steepest * Math.hypot(way[0], way[1]) - way[2], 1e-6); // the gap closes no faster
  /** @param {number} far @returns {[number, number]} */
  const placeAt = (far) => [eye[0] + far * way[0], eye[1] + far * way[1]];
  /** @param {number} far */
  const gapAt = (far) => eye[2] + far * way[2] - lift - heights.at(...placeAt(far))[0];
  const above = eye[2] - lift - heights.high; // of all ground: nothing is met before the ray is down there
  if (above > 0 && way[2] >= 0) return null;
  let far = above > 0 ? above / -way[2] : 0, before = far;
  if (!(far < farthest)) return null;
  for (let gap = gapAt(far); gap > 0; gap = gapAt(far)) {
    if (far >= farthest || (way[2] >= 0 && eye[2] + far * way[2] - lift > heights.high)) return null;
    before = far;
    far = Math.min(far + Math.max(gap / fall, LEAST * far, FIRST * farthest), farthest);
  }
  for (let k = 0; k < HALVINGS && before < far; k++) {
    const middle = 0.5 * (before + far);
    if (gapAt(middle) > 0) before = middle;
    else far = middle;
  }
  return placeAt(far);
}

/**
 * Longitude and latitude of the place where a ray meets a sphere.
 *
 * @param {number[]} eye
 * @param {number[]} way of length 1
 * @param {number} radius
 * @returns {[number, number] | null}
 */
function hitSphere(eye, way, radius) {
  const back = -dot(eye, way), far = Math.hypot(...eye), beside = radius * radius - (far * far - back * back);
  if (back <= 0 || beside < 0) return null;
  const [x, y, z] = eye.map((v, k) => v + (back - Math.sqrt(beside)) * way[k]);
  return [(Math.atan2(y, x) * 180) / Math.PI, (Math.atan2(z, Math.hypot(x, y)) * 180) / Math.PI];
}

/**
 * A place of the ground as a point of the world.
 *
 * @param {import("./heights.js").HeightField} heights @param {number} x @param {number} y
 */
export function pointAt(heights, x, y) {
  if (heights.kind === "sphere") return frameAt(x, y)[2].map((v) => v * heights.radius);
  return [x, y, heights.at(x, y)[0]];
}

/**
 * A point of the world in the picture, from the left and the upper edge, 0 to 1; null: it is behind the eye.
 *
 * @param {Camera} camera @param {number[]} point
 */
export function projectPoint({ eye, right, up, ahead, width, height, focal }, point) {
  const away = point.map((v, k) => v - eye[k]);
  /** @param {number[]} axis */
  const along = (axis) => axis[0] * away[0] + axis[1] * away[1] + axis[2] * away[2];
  const depth = along(ahead);
  if (depth < NEAREST) return null;
  return [0.5 + (focal * along(right)) / (depth * width), 0.5 - (focal * along(up)) / (depth * height)];
}
