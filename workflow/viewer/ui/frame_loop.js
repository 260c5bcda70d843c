// The frame loop: it draws while something changes, holds the frame rate by drawing less, and at rest draws ever finer
// pictures until all Gaussians are drawn. Each of these is drawn in slices beside the one that is shown.

import { BUDGET } from "../draw/pacing.js";
import { stepWalker } from "./walker.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("./viewer.js").Scene} Scene
 */

const MAX_STEP = 250; // milliseconds of walking that one frame makes up for
const SHADE = 5; // milliseconds of a turn for shadows
const QUIET = 700; // milliseconds at rest before its progress is said: fast devices are done by then

/** @param {Viewer} viewer */
export function runFrameLoop(viewer) {
  const { pacing, resting, tour } = viewer;
  let last = performance.now(), drew = false, paced = false;

  /** May a frame be drawn? While chunks arrive, previews at most. @param {Scene} scene @param {number} now */
  const mayDraw = ({ renderer, manifest, coarse }, now) => {
    if (viewer.loaded) return true;
    const due = renderer?.preview.isDue(now, coarse >= manifest.tiles.length) ?? false;
    if (due && !paced && renderer?.preview.took) {
      pacing.begin(renderer.preview.took);
      paced = true;
    }
    return due;
  };

  /** @param {Scene} scene @param {number} now @param {boolean} may */
  const ask = (scene, now, may) => {
    const shaded = scene.light?.step([scene.walker.x, scene.walker.y], SHADE) ?? true;
    if (shaded && !viewer.shaded) viewer.dirty = viewer.stale = true;
    viewer.shaded = shaded;
    if (viewer.stale) resting.restart(scene, now);
    if (viewer.stale && may && scene.client.idle) viewer.askWorker(viewer.loaded ? pacing.budget : BUDGET.least, false);
    else if (viewer.loaded && !viewer.stale && viewer.shaded) resting.step(scene, now);
  };

  /** Go on with the wind; a whole picture is drawn again in it. @param {Scene} scene @param {number} gap @param {boolean} moving */
  const blow = ({ renderer, frame }, gap, moving) => {
    const { whole } = resting;
    if (!renderer || (frame?.patient && !whole)) return; // a picture at rest is under way
    const due = viewer.wind.step(gap, renderer.picture.took, { sways: renderer.splats.sways, whole, moving });
    if (due && whole) viewer.drawFrame(1, viewer.wind.now);
    else if (due) viewer.dirty = true;
  };

  /** @param {number} now */
  const next = (now) => {
    requestAnimationFrame(next);
    const { scene } = viewer, gap = now - last;
    last = now;
    if (!scene) return;
    const { walker, renderer } = scene, stepped = stepWalker(walker, Math.min(gap, MAX_STEP) / 1000);
    const toured = tour.step(walker, scene.heights, gap / 1000);
    if (stepped || toured) viewer.dirty = viewer.stale = true;
    const may = mayDraw(scene, now), moving = viewer.stale;
    ask(scene, now, may);
    blow(scene, gap, moving);
    // the frame of a picture at rest may take the GPU seconds: it is drawn in slices alone
    const due = viewer.dirty && may && !scene.frame?.patient;
    if (!due || !drew) pacing.reset();
    else if (pacing.addFrame(gap, scene.frame?.count ?? 0)) viewer.stale = true;
    if (due) viewer.drawFrame(pacing.scale, viewer.wind.now);
    if (due && !viewer.loaded) renderer?.preview.addPicture();
    drew = due;
  };
  requestAnimationFrame(next);
}

/** Pictures at rest, and pictures to save, which wait for the finest. @param {Viewer} viewer */
export function createResting(viewer) {
  let budget = 0, since = 0, done = 0; // budget of the picture that is under way; share of all work
  /** @type {((canvas: HTMLCanvasElement) => void)[]} */
  const waiting = [];
  const handOver = () => {
    for (const take of waiting.splice(0)) take(viewer.canvas);
  };

  /** @param {import("../draw/renderer.js").Renderer} renderer @param {Scene} scene */
  function finish({ picture, rest }, { frame }) {
    viewer.show(picture);
    viewer.wind.still();
    rest.finish(budget, frame?.shrink === 1);
    if (!rest.whole || frame?.missing.length) return; // a chunk that arrives begins anew
    viewer.hud.showRefining(null);
    viewer.options.onWhole();
    handOver(); // now: the next turn may find the canvas empty
  }

  return {
    /** Something changed. @param {Scene} scene @param {number} now */
    restart({ renderer }, now) {
      const { budget: drawn, scale } = viewer.pacing;
      renderer?.picture.cancel();
      renderer?.rest.restart(now, scale < 1 ? 0 : drawn);
      [budget, since, done] = [0, now, 0];
      viewer.hud.showRefining(null);
    },
    /** Go on with the picture that is under way, or with the next. @param {Scene} scene @param {number} now */
    step(scene, now) {
      const { renderer, client, frame } = scene;
      if (!renderer) return;
      const { picture, rest } = renderer;
      if (picture.share !== null) {
        if (picture.advance(now)) finish(renderer, scene);
      } else if (client.idle && viewer.dirty && frame?.patient) viewer.begin(picture); // not idle: the frame is of an earlier view
      else if (client.idle && !viewer.dirty) {
        const next = rest.next(now);
        if (next) {
          budget = next;
          viewer.askWorker(next, true);
        }
      }
      if (rest.whole) return;
      done = Math.max(done, rest.progress(budget, picture.share ?? 0));
      if (now - since > QUIET) viewer.hud.showRefining(done);
    },
    /** Is the finest picture of the place shown? */
    get whole() {
      const { renderer, frame } = viewer.scene ?? {};
      return !viewer.stale && viewer.shaded && !frame?.missing.length && (renderer?.rest.whole ?? false);
    },
    /** How much of it is drawn, 0 to 1. */
    get done() {
      return done;
    },
    /**
     * Call back with the canvas when the finest picture of the place is on it, at once if it is.
     *
     * @param {(canvas: HTMLCanvasElement) => void} take must read the canvas before it returns
     */
    whenWhole(take) {
      waiting.push(take);
      const picture = viewer.scene?.renderer?.picture;
      if (!picture || !this.whole) return;
      viewer.show(picture);
      handOver();
    },
  };
}
