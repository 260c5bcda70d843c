// At rest nobody needs a frame rate: the same picture again with ever more Gaussians, while each is finished soon.

import { BUDGET } from "./pace.js";

const AFTER = 500; // milliseconds without a change
const MORE = 4; // times the Gaussians of the picture before
const LONGEST = 1200; // milliseconds that the next picture may be expected to take: so long nothing else is drawn

export function createRest(gl) {
  let since = 0, start = 0, fence = null, took = Infinity, budget = 0;
  const finished = () => fence === null || gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
  const forget = () => {
    gl.deleteSync(fence);
    fence = null;
  };
  return {
    /** Something has changed: pictures begin again with what the pace allows. */
    moved(now, allowed) {
      [since, took, budget] = [now, Infinity, allowed];
      forget();
    },
    /** A picture was handed to the graphics card. */
    drawn(now) {
      forget();
      [fence, start] = [gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0), now];
    },
    /** The budget of a picture that is now due, or null. whole: the last one had all there is. */
    next(now, whole) {
      if (!finished()) return null;
      if (fence) took = now - start;
      forget();
      const enough = whole || budget >= BUDGET.most || MORE * took > LONGEST;
      if (enough || now - since < AFTER) return null;
      took = Infinity; // until this one is drawn
      return (budget = Math.min(MORE * budget, BUDGET.most));
    },
  };
}
