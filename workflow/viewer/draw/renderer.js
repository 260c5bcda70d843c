// What draws a bundle on a graphics context: backdrop and splats, previews and idle refinement. Made again after the
// context was lost.

import { createIdleRefine } from "./idle_refine.js";
import { createPreview } from "./preview.js";
import { createSky } from "./sky.js";
import { createSplats } from "./splats.js";

/** @typedef {ReturnType<typeof createRenderer>} Renderer */

/**
 * @param {import("./gl.js").GL} gl
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 */
export function createRenderer(gl, manifest, heights) {
  const sky = createSky(gl, manifest), splats = createSplats(gl, manifest, heights);
  return {
    splats,
    idle: createIdleRefine(gl),
    preview: createPreview(gl),
    /**
     * @param {import("../terrain/camera.js").Camera} camera
     * @param {import("./splats.js").DrawOptions} options
     */
    draw(camera, options) {
      sky.draw(camera, options);
      splats.draw(camera, options);
    },
    end: () => splats.end(),
  };
}
