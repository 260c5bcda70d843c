// The frame loop: draws while something changes, holds the frame rate by drawing less, and draws finer at rest.

import { BUDGET } from "../draw/frame_pacing.js";
import { createGamepads } from "./gamepads.js";
import { keepPace } from "./kept_pace.js";
import { stepWalker } from "./walker.js";

const MAX_STEP = 250; // milliseconds of walking that one frame makes up for

/** @param {import("./viewer.js").Viewer} viewer */
export function runFrameLoop(viewer) {
  const { pacing, flyPath, resting, tour } = viewer;
  const pads = createGamepads();
  let last = performance.now(), drew = false, paced = keepPace(viewer.gl, pacing);

  /** May a frame be drawn? While chunks arrive, previews at most. @param {import("./viewer.js").Scene} scene @param {number} now */
  const mayDraw = ({ renderer, manifest, coarse }, now) => {
    if (viewer.loaded) return true;
    const due = renderer?.preview.isDue(now, coarse >= manifest.tiles.length) ?? false;
    if (due && !paced && renderer?.preview.took) {
      pacing.begin(renderer.preview.took);
      paced = true;
    }
    return due;
  };

  /** @param {import("./viewer.js").Scene} scene @param {number} now @param {boolean} may */
  const ask = (scene, now, may) => {
    if (viewer.stale) resting.restart(scene, now);
    if (viewer.stale && may && scene.client.idle) viewer.askWorker(viewer.loaded ? pacing.budget : BUDGET.least, false);
    else if (viewer.loaded && !viewer.stale) resting.step(scene, now);
  };

  /** @param {number} now */
  const next = (now) => {
    requestAnimationFrame(next);
    const { scene } = viewer, gap = now - last;
    last = now;
    if (!scene || viewer.suspended) return;
    const { walker, renderer } = scene;
    const flown = flyPath.step(walker, gap / 1000);
    const seconds = Math.min(gap, MAX_STEP) / 1000, stepped = stepWalker(walker, seconds), pushed = pads.step(walker, seconds);
    if (pushed && tour.on) dispatchEvent(new Event("gamepadinput"));
    const toured = tour.step(walker, scene.heights, gap / 1000);
    if (stepped || pushed || flown || toured) viewer.dirty = viewer.stale = true;
    const may = mayDraw(scene, now);
    ask(scene, now, may);
    // the frame of a picture at rest may take the GPU seconds: it is drawn in slices alone
    const due = viewer.dirty && may && !scene.frame?.patient;
    if (!due || !drew) pacing.reset();
    else if (pacing.addFrame(gap, scene.frame?.count ?? 0)) viewer.stale = true;
    if (due) viewer.drawFrame(pacing.scale);
    if (due && !viewer.loaded) renderer?.preview.addPicture();
    drew = due;
  };
  requestAnimationFrame(next);
}
