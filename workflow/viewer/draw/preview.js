// Previews while chunks arrive: the first when the coarsest level is there, the next when the one before is finished
// and most of the time since went to loading. On a slow machine previews would otherwise delay the chunks.

import { hasPassed } from "./gl.js";

const SHARE = 5; // times a picture's own duration that passes before the next

/** @param {import("./gl.js").GL} gl */
export function createPreview(gl) {
  let start = 0, next = 0, took = 0;
  /** @type {WebGLSync | null} */
  let fence = null;
  return {
    /** Milliseconds that the last finished picture took; 0: there is none. */
    get took() {
      return took;
    },
    /**
     * May a preview be drawn now?
     *
     * @param {number} now
     * @param {boolean} ready the coarsest level is there
     */
    isDue(now, ready) {
      if (fence) {
        if (!hasPassed(gl, fence)) return false;
        gl.deleteSync(fence);
        fence = null;
        took = now - start;
        next = now + SHARE * took;
      }
      if (now < next || !ready) return false;
      start = now;
      return true;
    },
    /** A preview was handed to the GPU. */
    addPicture() {
      fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    },
  };
}
