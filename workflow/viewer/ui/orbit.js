// Orbiting: the eye turns about the place that the middle of the picture shows, and comes nearer to it.

import { hitGround } from "../terrain/ray.js";
import { goBy, moveTo } from "./walker.js";

/** @typedef {ReturnType<typeof createOrbit>} Orbit */

const FARTHEST = 24; // tile sides to what is orbited; beyond, or in the sky, a place at AHEAD of them is
const AHEAD = 4;
const STEEPEST = -89, FLATTEST = -4; // degrees above the horizon

/** @param {import("./viewer.js").Viewer} viewer */
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
