// The terrain drawn on a WebGL2 context of others.

import { OVERLAYS } from "../draw/overlays.js";
import { createRenderer } from "../draw/renderer.js";
import { backdropOptions } from "../scene/backdrop_options.js";
import { checkCamera } from "./arguments.js";

/** @typedef {import("../scene/open_terrain.js").OpenTerrain} OpenTerrain */

/**
 * @param {import("../draw/gl.js").GL} gl
 * @param {Pick<OpenTerrain, "manifest" | "heights">} terrain
 * @param {() => void} onEnd
 */
export function createPainter(gl, terrain, onEnd) {
  const renderer = createRenderer(gl, terrain.manifest, terrain.heights);
  /** @type {import("../worker/frame_builder.js").FrameAnswer | null} */
  let frame = null;
  return {
    renderer,
    /** @param {import("../worker/frame_builder.js").FrameAnswer} answer */
    setFrame(answer) {
      frame = answer;
      renderer.splats.setFrame(answer);
    },
    painter: {
      /** @param {import("../terrain/camera.js").Camera} camera @param {{ backdrop?: boolean, overlay?: string }} [options] */
      draw(camera, { backdrop = true, overlay = OVERLAYS[0] } = {}) {
        const view = checkCamera(camera), number = OVERLAYS.indexOf(overlay);
        if (number < 0) throw new RangeError(`overlay: ${overlay} is none of ${OVERLAYS.join(", ")}`);
        const options = { ...backdropOptions(terrain, frame, view), overlay: number };
        gl.viewport(0, 0, view.width, view.height);
        if (backdrop) renderer.draw(view, options);
        else renderer.splats.draw(view, options);
      },
      end() {
        onEnd();
        renderer.end();
      },
    },
  };
}
