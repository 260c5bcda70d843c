// What other pages ask of a terrain: the ground, Gaussians for renderers of their own, and a painter for their context.
// What they pass in is checked before it reaches the worker: a NaN there would draw nothing and say nothing.

import { parseRecords } from "../data/compose.js";
import { deviationOf, MAX_TURN, TURN_STEPS } from "../data/layout.js";
import { OVERLAYS } from "../draw/overlays.js";
import { createRenderer } from "../draw/renderer.js";
import { backdropOptions } from "../scene/open_terrain.js";
import { hitGround } from "../terrain/camera.js";
import { REACH, tileUnder } from "../terrain/cells.js";
import { createDepthSorter, run } from "../terrain/draw_order.js";
import { createVariation } from "../terrain/variation.js";

/**
 * @typedef {import("../scene/open_terrain.js").OpenTerrain} OpenTerrain
 * @typedef {{ count: number, centres: Float32Array, deviations: Float32Array, turns: Float32Array,
 *   colours: Float32Array }} Gaussians
 * @typedef {{ number: number, direction: number[], indices: Uint32Array }} Order
 */

/**
 * A list of `many` finite numbers. Throws a TypeError.
 *
 * @param {string} name @param {ArrayLike<number>} values @param {number} many
 * @returns {number[]}
 */
function checkNumbers(name, values, many) {
  const list = values == null ? [] : Array.from(values);
  if (list.length !== many || !list.every(Number.isFinite)) throw new TypeError(`${name}: not ${many} finite numbers`);
  return list;
}

/**
 * A camera as the worker takes it. Throws a TypeError.
 *
 * @param {import("../terrain/camera.js").Camera} camera
 */
export function checkCamera({ eye, right, up, ahead, width, height, focal }) {
  if (!(Math.min(width, height, focal) > 0)) throw new TypeError("camera: width, height and focal are not above 0");
  checkNumbers("camera: width, height, focal", [width, height, focal], 3);
  return {
    eye: checkNumbers("camera.eye", eye, 3), right: checkNumbers("camera.right", right, 3),
    up: checkNumbers("camera.up", up, 3), ahead: checkNumbers("camera.ahead", ahead, 3), width, height, focal,
  };
}

/**
 * An index below `end`. Throws a RangeError.
 *
 * @param {string} name @param {number} value @param {number} end
 */
function checkIndex(name, value, end) {
  if (!Number.isInteger(value) || value < 0 || value >= end) throw new RangeError(`${name}: ${value} is not 0 to ${end - 1}`);
}

/**
 * Height and normal of the ground, its variation, the cell there, and where a ray meets it.
 *
 * @param {Pick<OpenTerrain, "manifest" | "heights" | "lift">} terrain
 */
export function createGround({ manifest, heights, lift }) {
  const variation = createVariation(manifest);
  /** @param {number} x @param {number} y */
  const height = (x, y) => {
    checkNumbers("x, y", [x, y], 2);
    return heights.at(x, y)[0] + lift;
  };
  /** @param {number} x @param {number} y @returns {[number, number, number]} */
  const normal = (x, y) => {
    checkNumbers("x, y", [x, y], 2);
    const [, east, north] = heights.at(x, y), long = Math.hypot(east, north, 1);
    return [-east / long || 0, -north / long || 0, 1 / long];
  };
  return {
    height,
    normal,
    /** @param {number} x @param {number} y @param {number} [material] */
    variation(x, y, material = 0) {
      checkNumbers("x, y", [x, y], 2);
      checkIndex("material", material, manifest.materials.length);
      return /** @type {[number, number, number]} */ (variation?.at(x, y, material) ?? [0, 0, 0]);
    },
    /** @param {number} x @param {number} y */
    cellAt(x, y) {
      checkNumbers("x, y", [x, y], 2);
      return tileUnder(manifest, heights, x, y);
    },
    /**
     * @param {ArrayLike<number>} origin @param {ArrayLike<number>} direction
     * @param {number} [farthest]
     */
    pick(origin, direction, farthest = REACH * manifest.tile_side) {
      const from = checkNumbers("origin", origin, 3), way = checkNumbers("direction", direction, 3);
      const long = Math.hypot(...way);
      if (!(long > 0)) throw new TypeError("direction has no length");
      if (!Number.isFinite(farthest)) throw new TypeError("farthest: not a finite number");
      const hit = hitGround(from, way.map((v) => v / long), heights, { lift, farthest });
      if (!hit) return null;
      const [x, y] = hit, point = /** @type {[number, number, number]} */ ([x, y, height(x, y)]);
      const distance = Math.hypot(...point.map((v, k) => v - from[k]));
      return { point, normal: normal(x, y), distance, ...tileUnder(manifest, heights, x, y) };
    },
  };
}

/**
 * A tile's Gaussians and their orders.
 *
 * @param {Pick<OpenTerrain, "manifest" | "client">} terrain
 * @param {Promise<boolean>} whole all parts were read
 * @param {() => void} checkRunning throws where the terrain was ended
 */
export function createChunkReader({ manifest, client }, whole, checkRunning) {
  const { tiles, objects = [], levels, encoding, directions } = manifest, sort = createDepthSorter();

  /** @param {number} tile @param {number} level */
  async function read(tile, level) {
    checkIndex("tile", tile, tiles.length + objects.length);
    checkIndex("level", level, levels.length);
    await whole;
    checkRunning();
    const composed = await client.recordsOf(tile, level);
    checkRunning();
    const { records, centres, sizes } = run(parseRecords(composed ?? new Uint32Array(0), encoding));
    return { records, centres, count: sizes.length, kept: (tiles[tile] ?? objects[tile - tiles.length]).orders };
  }

  return {
    /** @param {number} tile @param {number} level @returns {Promise<Gaussians>} */
    async gaussians(tile, level) {
      const { records, centres, count } = await read(tile, level), object = objects[tile - tiles.length];
      const middle = object ? manifest.tile_side / 2 : 0, foot = [middle, middle, 0]; // its z counts from the foot already
      return { count, centres: centres.map((v, k) => v - foot[k % 3]), ...decodeRecords(records, count, encoding) };
    },
    /** @param {number} tile @param {number} level @returns {Promise<Order[]>} */
    async orders(tile, level) {
      const { centres, count, kept } = await read(tile, level), depths = new Float32Array(count);
      return kept.map((number) => {
        const [x, y, z] = directions[number];
        for (let k = 0, c = 0; k < count; k++) depths[k] = centres[c++] * x + centres[c++] * y + centres[c++] * z;
        return { number, direction: directions[number], indices: sort(depths, count).slice() };
      });
    },
  };
}

/**
 * Shapes and colours of records, decoded as draw/shaders.js decodes them: standard deviations, quaternions w x y z, red
 * green blue opacity from 0 to 1.
 *
 * @param {Uint32Array} records @param {number} count
 * @param {import("../data/layout.js").Encoding} encoding
 */
function decodeRecords(records, count, encoding) {
  const deviations = new Float32Array(3 * count), turns = new Float32Array(4 * count);
  const colours = new Float32Array(4 * count);
  const sizes = Float32Array.from({ length: 256 }, (_, byte) => deviationOf(encoding, byte));
  for (let k = 0; k < count; k++) {
    const [, b, c, d] = records.subarray(4 * k, 4 * k + 4);
    deviations.set([sizes[(b >>> 16) & 255], sizes[b >>> 24], sizes[c & 255]], 3 * k);
    const [x, y, z] = [8, 16, 24].map((bits) => (((c >>> bits) & 255) - TURN_STEPS) * (MAX_TURN / TURN_STEPS));
    turns.set([Math.sqrt(Math.max(1 - x * x - y * y - z * z, 0)), x, y, z], 4 * k);
    colours.set([0, 8, 16, 24].map((bits) => ((d >>> bits) & 255) / 255), 4 * k);
  }
  return { deviations, turns, colours };
}

/** The sun of a terrain; null: none, or switched off. @param {Pick<OpenTerrain, "light">} terrain */
export function describeSun({ light }) {
  if (!light?.now) return null;
  const { hour, elevation, azimuth, direction } = light.now.sun;
  return { hour, elevation, azimuth: (azimuth + light.north) % 360, direction: /** @type {[number, number, number]} */ ([...direction]) };
}

/** @param {Pick<OpenTerrain, "light">} terrain @param {number | null | "off"} hour */
export function chooseSun({ light }, hour) {
  const isSun = hour === null || hour === "off" || Number.isFinite(hour);
  if (!isSun) throw new TypeError(`hour: ${hour} is not a finite number, null or "off"`);
  if (!light && typeof hour === "number") throw new TypeError("hour: this terrain has no sun");
  light?.choose(hour);
}

/**
 * @param {import("../draw/gl.js").GL} gl @param {Pick<OpenTerrain, "manifest" | "heights" | "light">} terrain
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
      /**
       * @param {import("../terrain/camera.js").Camera} camera
       * @param {{ backdrop?: boolean, overlay?: string, seconds?: number }} [options]
       */
      draw(camera, { backdrop = true, overlay = OVERLAYS[0], seconds } = {}) {
        const view = checkCamera(camera), number = OVERLAYS.indexOf(overlay);
        if (number < 0) throw new RangeError(`overlay: ${overlay} is none of ${OVERLAYS.join(", ")}`);
        if (seconds !== undefined && !Number.isFinite(seconds)) throw new TypeError("seconds: not a finite number");
        const wind = seconds === undefined ? null : { seconds, share: 1 };
        const options = { ...backdropOptions(terrain, frame, view), overlay: number, wind };
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
