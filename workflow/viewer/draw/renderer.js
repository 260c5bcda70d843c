// What draws a bundle on a graphics context: backdrop and splats, previews and pictures at rest. Made again after the
// context was lost.

import { createPreview } from "./preview.js";
import { createRest } from "./rest.js";
import { createSky } from "./sky.js";
import { createSlicedPicture } from "./sliced_picture.js";
import { createSplats } from "./splats.js";

/** @typedef {ReturnType<typeof createRenderer>} Renderer */

/**
 * @param {import("./gl.js").GL} gl
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 */
export function createRenderer(gl, manifest, heights) {
  const sky = createSky(gl, manifest), splats = createSplats(gl, manifest, heights);
  const picture = createSlicedPicture(gl, sky, splats);
  return {
    splats,
    rest: createRest(),
    picture,
    preview: createPreview(gl),
    /** A picture beside the shown one, of any size; to be ended. */
    createPicture: () => createSlicedPicture(gl, sky, splats),
    /**
     * @param {import("../terrain/camera.js").Camera} camera
     * @param {import("./splats.js").DrawOptions} options
     */
    draw(camera, options) {
      sky.draw(camera, options);
      splats.draw(camera, options);
    },
    end() {
      picture.end();
      splats.end();
    },
  };
}
