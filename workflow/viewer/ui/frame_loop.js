// The frame loop: draws while something changes, and holds the frame rate by drawing fewer Gaussians.

import { BUDGET } from "../draw/frame_pacing.js";
import { stepWalker } from "./walker.js";

const MAX_STEP = 250; // milliseconds of walking that one frame makes up for

/** @param {import("./viewer.js").Viewer} viewer */
export function runFrameLoop(viewer) {
  const { pacing, flyPath } = viewer;
  let last = performance.now(), drew = false;

  /** @param {import("./viewer.js").Scene} scene @param {number} now @param {boolean} mayDraw */
  const ask = ({ client, renderer, frame }, now, mayDraw) => {
    if (viewer.stale) renderer?.idle.restart(now, pacing.budget);
    if (viewer.stale && mayDraw && client.idle) viewer.askWorker(viewer.loaded ? pacing.budget : BUDGET.least, false);
    else if (viewer.loaded && !viewer.dirty && client.idle) {
      const more = renderer?.idle.nextBudget(now, frame?.shrink === 1);
      if (more) viewer.askWorker(more, true);
    }
  };

  /** @param {import("./viewer.js").Scene} scene @param {number} now */
  const draw = (scene, now) => {
    const { renderer } = scene;
    viewer.drawFrame();
    if (!viewer.loaded) renderer?.preview.addPicture();
    renderer?.idle.addPicture(now);
    return !scene.frame?.patient; // a refined picture may take its time
  };

  /** @param {number} now */
  const next = (now) => {
    requestAnimationFrame(next);
    const { scene } = viewer, gap = now - last;
    last = now;
    if (!scene) return;
    const { walker, renderer, manifest, coarse } = scene;
    const flown = flyPath.step(walker, gap / 1000);
    if (stepWalker(walker, Math.min(gap, MAX_STEP) / 1000) || flown) viewer.dirty = viewer.stale = true;
    const mayDraw = viewer.loaded || (renderer?.preview.isDue(now, coarse >= manifest.tiles.length) ?? false);
    ask(scene, now, mayDraw);
    const due = viewer.dirty && mayDraw;
    if (!due || !drew) pacing.reset();
    else if (pacing.addFrame(gap, scene.frame?.count ?? 0)) viewer.stale = true;
    drew = due && draw(scene, now);
  };
  requestAnimationFrame(next);
}
