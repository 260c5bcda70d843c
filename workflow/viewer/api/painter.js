// The terrain drawn on a WebGL2 context of others.

import { OVERLAYS } from "../draw/overlays.js";
import { createRenderer } from "../draw/renderer.js";
import { backdropOptions } from "../scene/open_terrain.js";
import { checkCamera } from "./queries.js";

/** @typedef {import("../scene/open_terrain.js").OpenTerrain} OpenTerrain */

/**
 * @param {import("../draw/gl.js").GL} gl
 * @param {Pick<OpenTerrain, "manifest" | "heights">} terrain
 * @param {() => void} onEnd
 */
export function createPainter(gl, terrain, onEnd) {
  resetState(gl);
  const renderer = createRenderer(gl, terrain.manifest, terrain.heights);
  /** @type {import("../worker/frame_builder.js").FrameAnswer | null} */
  let frame = null;
  return {
    /** @param {import("../worker/worker.js").Records} records */
    addRecords(records) {
      resetState(gl);
      renderer.splats.addRecords(records);
    },
    /** @param {import("../worker/frame_builder.js").FrameAnswer} answer */
    setFrame(answer) {
      resetState(gl);
      frame = answer;
      renderer.splats.setFrame(answer);
    },
    painter: {
      /** @param {import("../terrain/camera.js").Camera} camera @param {{ backdrop?: boolean, overlay?: string }} [options] */
      draw(camera, { backdrop = true, overlay = OVERLAYS[0] } = {}) {
        const view = checkCamera(camera), number = OVERLAYS.indexOf(overlay);
        if (number < 0) throw new RangeError(`overlay: ${overlay} is none of ${OVERLAYS.join(", ")}`);
        const options = { ...backdropOptions(terrain, frame, view), overlay: number };
        resetState(gl);
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

/** What others may have set on the context, as our drawing and uploading expects it. @param {import("../draw/gl.js").GL} gl */
function resetState(gl) {
  for (const test of [gl.DEPTH_TEST, gl.CULL_FACE, gl.SCISSOR_TEST, gl.STENCIL_TEST]) gl.disable(test);
  gl.blendEquation(gl.FUNC_ADD);
  gl.colorMask(true, true, true, true);
  gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
  for (const [name, value] of /** @type {[number, number | boolean][]} */ ([
    [gl.UNPACK_FLIP_Y_WEBGL, false], [gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false], [gl.UNPACK_ALIGNMENT, 4],
    [gl.UNPACK_ROW_LENGTH, 0], [gl.UNPACK_SKIP_ROWS, 0], [gl.UNPACK_SKIP_PIXELS, 0],
  ])) gl.pixelStorei(name, value);
}
