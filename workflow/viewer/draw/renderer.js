// What draws a bundle on a graphics context: backdrop and splats, previews and pictures at rest. Made again after the
// context was lost.

import { createFarGround } from "./far_ground.js";
import { createTexture, hasPassed } from "./gl.js";
import { createPreview, createRest } from "./pacing.js";
import { createSky } from "./sky.js";
import { createSplats } from "./splats.js";

/**
 * @typedef {import("./gl.js").GL} GL
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {import("./splats.js").DrawOptions} DrawOptions
 * @typedef {ReturnType<typeof createRenderer>} Renderer
 * @typedef {ReturnType<typeof createSlicedPicture>} SlicedPicture
 */

const FIRST = 64; // blocks of the first slice of a picture
const GOAL = 40; // milliseconds of a slice: somebody who walks on waits for one
const GROW = 2; // times the blocks of the slice before, at most
const TURN = 1000 / 60; // milliseconds by which a slice may be finished before that is seen
const MOST = 250; // slices of a picture: where each waits long whatever its size, a picture still ends

/**
 * @param {GL} gl @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 */
export function createRenderer(gl, manifest, heights) {
  const sky = createSky(gl, manifest), splats = createSplats(gl, manifest, heights);
  const farGround = createFarGround(gl, manifest, heights, splats.relief);
  const backdrop = {
    /** @param {Camera} camera @param {DrawOptions} options */
    draw(camera, options) {
      sky.draw(camera, options);
      farGround?.draw(camera, options);
    },
  };
  const picture = createSlicedPicture(gl, backdrop, splats);
  return {
    splats,
    rest: createRest(),
    picture,
    preview: createPreview(gl),
    /** @param {Camera} camera @param {DrawOptions} options */
    draw(camera, options) {
      backdrop.draw(camera, options);
      splats.draw(camera, options);
    },
    end() {
      picture.end();
      splats.end();
    },
  };
}

/**
 * A picture in slices: some blocks at a time into a texture, so that the device stays at hand however slow it is. The
 * canvas keeps what it shows until the picture is whole.
 *
 * @param {GL} gl @param {Pick<import("./sky.js").Sky, "draw">} sky
 * @param {Pick<import("./splats.js").Splats, "draw" | "length">} splats
 */
export function createSlicedPicture(gl, sky, splats) {
  const framebuffer = gl.createFramebuffer();
  /** @type {{ texture: WebGLTexture, width: number, height: number } | null} */
  let target = null;
  /** @type {{ camera: Camera, options: DrawOptions, at: number, many: number, start: number, worked: number } | null} */
  let job = null;
  let took = Infinity;
  /** @type {WebGLSync | null} */
  let fence = null;
  const forgetFence = () => {
    gl.deleteSync(fence);
    fence = null;
  };

  /** @param {number} width @param {number} height */
  function fit(width, height) {
    if (target?.width === width && target.height === height) return;
    if (target) gl.deleteTexture(target.texture);
    target = { texture: createTexture(gl, gl.RGBA8, width, height), width, height };
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target.texture, 0);
  }

  /** Draw into the texture. @param {Camera} camera @param {() => void} draw */
  function drawInto({ width, height }, draw) {
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.viewport(0, 0, width, height);
    draw();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  return {
    /** Milliseconds of work, at least, of the last whole picture. */
    get took() {
      return took;
    },
    /** How much of the picture is drawn, 0 to 1; null: none is under way. */
    get share() {
      return job && job.at / Math.max(1, splats.length);
    },
    /**
     * Begin the picture of the splats' last frame; one that was under way is given up.
     *
     * @param {Camera} camera @param {DrawOptions} options
     */
    begin(camera, options) {
      forgetFence();
      gl.activeTexture(gl.TEXTURE0);
      fit(camera.width, camera.height);
      drawInto(camera, () => sky.draw(camera, options));
      job = { camera, options, at: 0, many: FIRST, start: 0, worked: 0 };
    },
    /** Draw the next slice if the GPU has finished the last. Returns: is the picture whole? @param {number} now */
    advance(now) {
      if (!job || !hasPassed(gl, fence)) return false;
      if (fence) {
        job.many = Math.max(splats.length / MOST, job.many * Math.min(GROW, GOAL / Math.max(1, now - job.start)));
        job.worked += Math.max(0, now - job.start - TURN);
      }
      forgetFence();
      const { camera, options, at } = job, many = Math.ceil(job.many);
      if (at >= splats.length) {
        took = job.worked;
        return true;
      }
      drawInto(camera, () => splats.draw(camera, options, at, many));
      fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      Object.assign(job, { at: Math.min(at + many, splats.length), start: now });
      return false;
    },
    /** Show the last whole picture on a canvas of its size. */
    show() {
      if (!target) return;
      const { width, height } = target;
      [job, fence] = [null, null];
      gl.clear(gl.COLOR_BUFFER_BIT); // Chromium clears a canvas at its first use in a turn, and a blit then reads it instead
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, framebuffer);
      gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
      gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
      gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    },
    /** Give up the picture that is under way. */
    cancel() {
      forgetFence();
      job = null;
    },
    /** Free the texture. */
    end() {
      forgetFence();
      if (target) gl.deleteTexture(target.texture);
      gl.deleteFramebuffer(framebuffer);
      job = target = null;
    },
  };
}
