// Values under the pointer, while an overlay is shown.

import { NO_ORDER } from "../data/layout.js";
import { REACH, tileUnder } from "../terrain/cells.js";
import { hitGround, pointAt, rayThrough } from "../terrain/ray.js";

/** @param {import("./viewer.js").Viewer} viewer */
export function tellValues(viewer) {
  const { canvas } = viewer;
  /** @type {{ clientX: number, clientY: number } | null} */
  let pointer = null;
  const tell = () => {
    if (viewer.overlay === 0 || !viewer.scene || !pointer) return;
    const { clientX, clientY } = pointer;
    viewer.hud.legend.tell(valuesAt(viewer.scene, viewer.camera(viewer.scene), clientX / canvas.clientWidth, clientY / canvas.clientHeight));
  };
  for (const name of /** @type {const} */ (["pointermove", "pointerdown"])) {
    canvas.addEventListener(name, (event) => {
      pointer = event;
      tell();
    });
  }
  canvas.addEventListener("pointerleave", () => (pointer = null));
  setInterval(tell, 250); // the ground moves on and is refined under a pointer at rest
}

/**
 * Tile, finest level and order that are drawn at a point of the picture; null: there is no ground.
 *
 * @param {import("./viewer.js").Scene} scene
 * @param {import("../terrain/camera.js").Camera} camera
 * @param {number} across
 * @param {number} down
 */
export function valuesAt({ manifest, heights, lift, frame }, camera, across, down) {
  const side = manifest.tile_side;
  const place = hitGround(camera.eye, rayThrough(camera, across, down), heights, { lift, farthest: REACH * side });
  if (!place) return null;
  const { i, j, tile } = tileUnder(manifest, heights, place[0], place[1]), point = pointAt(heights, place[0], place[1]);
  const distance = Math.hypot(...point.map((v, k) => v - camera.eye[k]));
  for (let k = 0; frame && k < frame.drawn.length; k += 6) {
    const [di, dj, , lo, hi, order] = frame.drawn.subarray(k, k + 6);
    if (frame.i0 + di !== i || frame.j0 + dj !== j) continue;
    let level = lo;
    while (level < hi && distance > frame.switches[level]) level += 1;
    return { tile, level, order: order === NO_ORDER ? null : order };
  }
  return { tile, level: null, order: null };
}
