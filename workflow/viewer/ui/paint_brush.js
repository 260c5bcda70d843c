// The brush: strokes of a pointer or of the space bar on the ground, and the ring that shows where it is.

import { hitGround, projectPoint, rayThrough } from "../terrain/camera.js";
import { element, isField } from "./dom.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {ReturnType<typeof createBrush>} Brush
 */

const RING = 64; // points of the ring
const DENSEST = 0.5, MOST_DABS = 64; // of a stroke between two events: radii from dab to dab, dabs
export const ERASER = -1;
export const SIZES = { least: 0.2, first: 0.6, most: 4 }; // radius, in tile sides

/** @param {Viewer} viewer @param {(trouble: "far" | "full" | "sky" | null) => void} onDab */
export function createBrush(viewer, onDab) {
  const svg = element("brush", SVGElement), ring = svg.querySelectorAll("polygon");
  let at = [0.5, 0.5]; // of the picture
  /** @type {[number, number] | null} */
  let last = null;
  /** @type {number | "key" | null} */
  let holder = null; // the pointer that paints
  const brush = {
    /** Material, ERASER, or null: dragging looks around. @type {number | null} */
    material: /** @type {number | null} */ (null),
    radius: SIZES.first,

    /** A pointer went down. Returns: does it paint? @param {PointerEvent} event */
    begin(event) {
      if (brush.material === null || event.button !== 0 || !viewer.scene) return false;
      moveTo(event);
      startStroke(event.pointerId);
      return true;
    },
    /** A pointer moved. Returns: is it painting? @param {PointerEvent} event */
    move(event) {
      if (brush.material === null) return false;
      if (holder === null || holder === event.pointerId) moveTo(event);
      if (holder !== event.pointerId) return false;
      continueStroke();
      return true;
    },
    /** A pointer was lifted. @param {PointerEvent} event */
    end(event) {
      if (holder === event.pointerId) endStroke();
    },
    /** A second finger came down: it walks, so what the first has painted goes. */
    cancel() {
      if (holder === null) return;
      holder = last = null;
      viewer.scene?.painting.cancel();
    },
    /** Draw the ring, or hide it. */
    draw() {
      const corners = brush.material === null ? [] : outline();
      svg.toggleAttribute("hidden", !corners.length);
      for (const one of ring) one.setAttribute("points", corners.map(([x, y]) => `${x},${y}`).join(" "));
    },
  };

  /** @param {PointerEvent} event */
  function moveTo({ clientX, clientY }) {
    const { left, top, width, height } = viewer.canvas.getBoundingClientRect();
    at = [(clientX - left) / width, (clientY - top) / height];
    brush.draw();
  }

  /** The place on the ground under the brush. */
  function placeUnder() {
    const { scene } = viewer;
    if (!scene) return null;
    const camera = viewer.camera(scene), { manifest: { tile_side: side }, heights, lift } = scene;
    return hitGround(camera.eye, rayThrough(camera, at[0], at[1]), heights, { lift, farthest: 48 * side });
  }

  /** @param {number | "key"} who */
  function startStroke(who) {
    const { painting } = viewer.scene ?? {}, place = placeUnder();
    if (!painting || !place) return onDab("sky");
    holder = who;
    painting.begin();
    last = place;
    dab(place);
  }

  function continueStroke() {
    const { scene } = viewer, place = placeUnder();
    if (!scene || !place) return;
    const from = last ?? place, far = Math.hypot(place[0] - from[0], place[1] - from[1]);
    const dabs = Math.min(Math.ceil(far / (DENSEST * brush.radius * scene.manifest.tile_side)), MOST_DABS);
    last = place;
    for (let k = 1; k <= dabs; k++) {
      dab([from[0] + (k / dabs) * (place[0] - from[0]), from[1] + (k / dabs) * (place[1] - from[1])]);
    }
  }

  function endStroke() {
    holder = last = null;
    viewer.scene?.painting.end();
  }

  /** @param {[number, number]} place */
  function dab([x, y]) {
    const { scene } = viewer;
    if (!scene || brush.material === null) return;
    onDab(scene.painting.dab(x, y, brush.radius * scene.manifest.tile_side, brush.material));
  }

  /** The ring in the picture, 0 to 1. */
  function outline() {
    const { scene } = viewer, place = placeUnder();
    if (!scene || !place) return [];
    const camera = viewer.camera(scene), radius = brush.radius * scene.manifest.tile_side, corners = [];
    for (let k = 0; k < RING; k++) {
      const x = place[0] + radius * Math.cos((2 * Math.PI * k) / RING);
      const y = place[1] + radius * Math.sin((2 * Math.PI * k) / RING);
      const corner = projectPoint(camera, [x, y, scene.heights.at(x, y)[0] + scene.lift]);
      if (corner) corners.push(corner);
    }
    return corners;
  }

  addEventListener("keydown", (event) => {
    const chosen = event.target instanceof HTMLInputElement && event.target.type === "radio"; // it has no use for space
    if (event.code !== "Space" || brush.material === null || (isField(event.target) && !chosen)) return;
    event.preventDefault();
    if (event.repeat) continueStroke();
    else if (holder === null) startStroke("key");
  });
  addEventListener("keyup", (event) => {
    if (event.code === "Space" && holder === "key") endStroke();
  });
  viewer.canvas.addEventListener("contextmenu", (event) => {
    if (brush.material !== null) event.preventDefault(); // another button than the first looks around
  });
  return brush;
}
