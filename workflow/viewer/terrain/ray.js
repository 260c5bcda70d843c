// Where a ray from the eye meets the ground.

const MOST = 400; // steps
const NEAREST = 1e-6; // depth of what is before the eye
const CLOSE = 1e-4; // of the distance: near enough to the ground

/**
 * The direction of a ray through a point of the picture.
 *
 * @param {import("./camera.js").Camera} camera
 * @param {number} across from the left edge to the right, 0 to 1
 * @param {number} down from the upper edge to the lower, 0 to 1
 */
export function rayThrough({ right, up, ahead, width, height, focal }, across, down) {
  const x = ((across - 0.5) * width) / focal, y = ((0.5 - down) * height) / focal, long = Math.hypot(1, x, y);
  return [0, 1, 2].map((k) => (ahead[k] + x * right[k] + y * up[k]) / long);
}

/**
 * The place where a ray first comes down to the ground; null: it does not within `farthest`.
 *
 * Each step goes as far as no slope of the surface could reach it.
 *
 * @param {number[]} eye
 * @param {number[]} way of length 1
 * @param {import("./heights.js").HeightField} heights
 * @param {{ lift: number, farthest: number }} ground lift: height of the ground of tiles above the surface
 * @returns {[number, number] | null}
 */
export function hitGround(eye, way, heights, { lift, farthest }) {
  const fall = Math.max(heights.steepest * Math.hypot(way[0], way[1]) - way[2], 1e-6); // the gap closes no faster
  for (let step = 0, far = 0; step < MOST && far < farthest; step++) {
    const x = eye[0] + far * way[0], y = eye[1] + far * way[1];
    const gap = eye[2] + far * way[2] - lift - heights.at(x, y)[0];
    if (gap <= CLOSE * Math.max(far, 1e-3)) return [x, y];
    far += gap / fall;
  }
  return null;
}

/**
 * A point of the world in the picture, from the left and the upper edge, 0 to 1; null: it is behind the eye.
 *
 * @param {import("./camera.js").Camera} camera
 * @param {number[]} point
 */
export function projectPoint({ eye, right, up, ahead, width, height, focal }, point) {
  const away = point.map((v, k) => v - eye[k]);
  /** @param {number[]} axis */
  const along = (axis) => axis[0] * away[0] + axis[1] * away[1] + axis[2] * away[2];
  const depth = along(ahead);
  if (depth < NEAREST) return null;
  return [0.5 + (focal * along(right)) / (depth * width), 0.5 - (focal * along(up)) / (depth * height)];
}
