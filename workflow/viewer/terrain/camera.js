// The camera of an eye on the terrain.

import { frameAt } from "./sphere.js";

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

/**
 * The camera of an eye at a place, for a picture of this size.
 *
 * @param {Place} place
 * @param {number} width
 * @param {number} height
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
