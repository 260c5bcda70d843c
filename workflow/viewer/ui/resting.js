// At rest: ever finer pictures of the place until all Gaussians are drawn, each in slices beside the one that is shown;
// and pictures to keep, which wait for the finest.

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("./viewer.js").Scene} Scene
 * @typedef {ReturnType<typeof createResting>} Resting
 */

const QUIET = 700; // milliseconds at rest before its progress is said: fast devices are done by then

/** @param {Viewer} viewer */
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
      return !viewer.stale && !frame?.missing.length && (renderer?.rest.whole ?? false);
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
