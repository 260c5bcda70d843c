// Pictures of any size, drawn beside the one that is shown: in slices, of as many Gaussians as are asked for. The frame
// loop rests meanwhile, since the worker's frame is the capture's.

import { PageError } from "../data/errors.js";
import { cameraAt } from "../terrain/camera.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("../draw/renderer.js").Renderer} Renderer
 * @typedef {import("../draw/sliced_picture.js").SlicedPicture} SlicedPicture
 * @typedef {(place: import("../terrain/camera.js").Place, budget: number, onProgress: (share: number) => void)
 *   => Promise<HTMLCanvasElement>} Capture draws a place onto the canvas that it returns, which is used again
 */

const STRIP = 64; // rows that are read from the GPU at once
const TURN = 4; // milliseconds until the GPU is looked at again
const FULL = "A picture of this size does not fit into this device's graphics memory. Choose a smaller one.";

/**
 * Let `work` capture pictures of a size. Throws what `work` throws, the signal's reason when it is aborted, and a
 * PageError: the pictures are too large, or the graphics context is lost.
 *
 * @param {Viewer} viewer
 * @param {{ width: number, height: number, signal: AbortSignal }} options
 * @param {(capture: Capture) => Promise<void>} work
 */
export async function capturing(viewer, { width, height, signal }, work) {
  const { scene } = viewer, renderer = scene?.renderer;
  if (!scene || !renderer || viewer.suspended) return;
  const picture = renderer.createPicture(), canvas = document.createElement("canvas");
  const pen = canvas.getContext("2d");
  if (!pen) throw new PageError(FULL);
  Object.assign(canvas, { width, height });
  const check = () => {
    signal.throwIfAborted();
    if (viewer.scene !== scene) throw new DOMException("another terrain was opened", "AbortError");
    if (scene.renderer !== renderer) throw new PageError("The graphics driver took the picture away. Try again.");
  };
  viewer.suspended = true;
  try {
    await work(async (place, budget, onProgress) => {
      const camera = cameraAt(place, width, height, scene.heights);
      await scene.askForAll(camera, budget, check);
      picture.begin(camera, viewer.drawOptions(scene, camera));
      if (viewer.gl.getError() === viewer.gl.OUT_OF_MEMORY) throw new PageError(FULL);
      while (!picture.advance(performance.now())) {
        onProgress(picture.share ?? 0);
        await new Promise((done) => setTimeout(done, TURN));
        check();
      }
      copyPicture(picture, pen, width, height);
      return canvas;
    });
  } finally {
    picture.end();
    canvas.width = canvas.height = 0; // some browsers keep the memory for long otherwise
    viewer.suspended = false;
    viewer.redraw();
  }
}

/** Rows come from the GPU from below. @param {SlicedPicture} picture @param {CanvasRenderingContext2D} pen @param {number} width @param {number} height */
function copyPicture(picture, pen, width, height) {
  const below = new Uint8Array(4 * width * STRIP), strip = new ImageData(width, STRIP);
  for (let from = 0; from < height; from += STRIP) {
    const rows = Math.min(STRIP, height - from);
    picture.read(from, rows, below);
    for (let row = 0; row < rows; row++) {
      strip.data.set(below.subarray(4 * width * row, 4 * width * (row + 1)), 4 * width * (STRIP - 1 - row));
    }
    pen.putImageData(strip, 0, height - from - STRIP, 0, STRIP - rows, width, rows);
  }
}
