// Idle refinement: while nothing moves, the same picture again with ever more Gaussians, as long as each is quick.

import { BUDGET } from "./frame_pacing.js";
import { hasPassed } from "./gl.js";

const DELAY = 500; // milliseconds without a change
const MORE = 4; // times the Gaussians of the picture before
const LONGEST = 1200; // milliseconds that the next picture may be expected to block drawing

/** @param {import("./gl.js").GL} gl */
export function createIdleRefine(gl) {
  let since = 0, start = 0, took = Infinity, budget = 0;
  /** @type {WebGLSync | null} */
  let fence = null;
  const forgetFence = () => {
    gl.deleteSync(fence);
    fence = null;
  };
  return {
    /**
     * Something changed: refinement starts over from this budget.
     *
     * @param {number} now
     * @param {number} allowed
     */
    restart(now, allowed) {
      [since, took, budget] = [now, Infinity, allowed];
      forgetFence();
    },
    /** A picture was handed to the GPU. @param {number} now */
    addPicture(now) {
      forgetFence();
      [fence, start] = [gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), now];
    },
    /**
     * The budget of a picture that is due now, or null.
     *
     * @param {number} now
     * @param {boolean} whole the last picture had all Gaussians
     */
    nextBudget(now, whole) {
      if (!hasPassed(gl, fence)) return null;
      if (fence) took = now - start;
      forgetFence();
      const enough = whole || budget >= BUDGET.most || MORE * took > LONGEST;
      if (enough || now - since < DELAY) return null;
      took = Infinity; // until this one is drawn
      budget = Math.min(MORE * budget, BUDGET.most);
      return budget;
    },
  };
}
