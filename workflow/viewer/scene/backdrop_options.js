// Where the tiles of a picture end and its backdrop begins.

import { REACH } from "../terrain/cells.js";
import { findEnd, findReach } from "../terrain/sphere_cells.js";

const MIN_LOW = 1e-4; // sine of the angle below the horizon at which tiles end, at least

/**
 * `end` and `low` of the options that renderers take.
 *
 * @param {{ manifest: import("../data/manifest.js").Manifest, heights: import("../terrain/heights.js").HeightField }} terrain
 * @param {import("../worker/frame_builder.js").FrameAnswer | null} frame the last one
 * @param {import("../terrain/camera.js").Camera} camera
 */
export function backdropOptions({ manifest, heights }, frame, camera) {
  const farthest = REACH * manifest.tile_side;
  if (heights.kind === "sphere") {
    return findEnd(heights, camera.eye, frame?.reach ?? findReach({ side: manifest.tile_side }, heights, camera.eye));
  }
  return { end: frame?.reach ?? farthest, low: Math.max(MIN_LOW, (camera.eye[2] - heights.low) / farthest) };
}
