// Splats on the GPU: all records in one texture, pages of orders in another, and two instanced draws a picture, one for
// far tiles and one for the 3 x 3 block about the eye. A block of instances is a page of entries in one cell.

import { PageError } from "../data/checks.js";
import {
  BLOCK, MAX_LEVELS, NEAR, orderPages, PAGE, PAGES_A_ROW, PLACE, PLACES_A_ROW, recordRows, ROW,
} from "../data/layout.js";
import { REACH } from "../terrain/cells.js";
import { MAX_OCTAVES } from "../terrain/heights.js";
import { rateOf } from "../terrain/sphere.js";
import { createVariation, VARIATION } from "../terrain/variation.js";
import { createProgram, createTexture, setAxes } from "./gl.js";
import { createShadowTexture, setLight } from "./lighting.js";
import { OBJECTS, overlayColours } from "./overlays.js";
import { FAR_HAZE, FRAGMENT, vertexShader } from "./shaders.js";
import { setHorizon } from "./sky.js";
import { measureStem, setWind } from "./wind.js";

/**
 * @typedef {import("./gl.js").GL} GL
 * @typedef {import("../data/manifest.js").Manifest} Manifest
 * @typedef {import("../terrain/heights.js").HeightField} HeightField
 * @typedef {import("../terrain/variation.js").Variation} Variation
 * @typedef {import("../worker/frame_builder.js").FrameAnswer} FrameAnswer
 * @typedef {Record<string, WebGLUniformLocation | null>} Uniforms
 *
 * end: distance at which the last tiles are blended into the backdrop; low: sine of the angle below the horizon there;
 * light: null: colours as captured; wind: absent: none.
 * @typedef {{ end: number, low: number, overlay: number, light: import("../terrain/light.js").Lighting | null,
 *   wind?: import("./wind.js").Wind | null }} DrawOptions
 * @typedef {ReturnType<typeof createSplats>} Splats
 */

const FULL = "The terrain does not fit into this machine's graphics memory. Close other pages, make one with larger "
  + "tiles or fewer variants, or open it on a larger machine.";
const WIDTH = PAGE * PAGES_A_ROW; // of the order textures
const QUADS = Uint16Array.from({ length: 6 * PAGE }, (_, k) => 4 * Math.floor(k / 6) + [0, 1, 2, 2, 1, 3][k % 6]);
export const RELIEF = 2;
const RECORDS = 0, ENTRIES = 1, HUES = 3, PLACES = 4, OWNERS = 5, SHADOWS = 6, STEMS = 7; // texture units

/** @param {GL} gl @param {Manifest} manifest @param {HeightField} heights */
export function createSplats(gl, manifest, heights) {
  const variation = createVariation(manifest);
  const programs = [0, 1, 2, 3].map((k) => once(() => { // 1: in the light of a sun, 2: in the wind
    const program = createProgram(gl, vertexShader(heights.kind, variation, k % 2 > 0, k > 1), FRAGMENT), { uniforms } = program;
    program.use();
    setConstants(gl, uniforms, manifest, heights);
    if (variation) setWaves(gl, uniforms, variation);
    return program;
  }));
  const isLit = manifest.light !== undefined && heights.kind !== "sphere";
  programs[Number(isLit)](); // other programs are compiled at their first use
  const tallest = Math.max(recordRows(manifest), orderPages(manifest) / PAGES_A_ROW);
  if (tallest > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new PageError(FULL);
  const records = createTexture(gl, gl.RGBA32UI, ROW, recordRows(manifest));
  const entries = createTexture(gl, gl.R32UI, WIDTH, orderPages(manifest) / PAGES_A_ROW);
  const far = createBlocks(gl), close = createBlocks(gl);
  let nearEntries = createTexture(gl, gl.R32UI, WIDTH, 1), nearRows = 1;
  let places = createTexture(gl, gl.RGBA32UI, 2 * PLACES_A_ROW, 1), placeRows = 1;
  /** @type {FrameAnswer | null} */
  let frame = null;
  const relief = heights.kind === "image" ? createRelief(gl, heights) : null;
  const shadows = isLit && heights.kind !== "flat" ? createShadowTexture(gl) : null;
  const hues = createTexture(gl, gl.RGBA8, 256, 1), owners = createTexture(gl, gl.R32UI, 1, recordRows(manifest));
  const each = manifest.tiles.length / manifest.materials.length;
  const stems = manifest.wind && heights.kind !== "sphere" ? createTexture(gl, gl.RG32F, 1, recordRows(manifest)) : null;
  let shownOverlay = -1, sways = false;
  if (gl.getError() === gl.OUT_OF_MEMORY) throw new PageError(FULL);

  /** @param {number} unit @param {WebGLTexture} texture */
  function bind(unit, texture) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
  }

  /** Copy the places of objects. @param {Uint32Array} words */
  function setPlaces(words) {
    const rows = Math.ceil(words.length / (PLACE * PLACES_A_ROW));
    if (!rows) return;
    if (rows > placeRows) {
      gl.deleteTexture(places);
      placeRows = 2 * rows;
      places = createTexture(gl, gl.RGBA32UI, 2 * PLACES_A_ROW, placeRows);
    }
    const data = new Uint32Array(rows * PLACE * PLACES_A_ROW);
    data.set(words);
    bind(PLACES, places);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 2 * PLACES_A_ROW, rows, gl.RGBA_INTEGER, gl.UNSIGNED_INT, data);
  }

  return {
    /**
     * Copy a chunk's records to their rows.
     *
     * @param {{ tile: number, level: number, rows: Uint32Array, records: Uint32Array }} chunk
     */
    addRecords({ tile, level, rows, records: words }) {
      const object = manifest.objects?.[tile - manifest.tiles.length], material = object?.material ?? Math.floor(tile / each);
      const owner = Uint32Array.of((object ? OBJECTS : material) + 256 * material);
      bind(OWNERS, owners);
      for (const row of rows) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, 1, 1, gl.RED_INTEGER, gl.UNSIGNED_INT, owner);
      if (stems) {
        const stem = measureStem(manifest, { tile, level, records: words });
        sways ||= stem[1] > 0;
        bind(STEMS, stems);
        for (const row of rows) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, 1, 1, gl.RG, gl.FLOAT, Float32Array.from(stem));
      }
      bind(RECORDS, records);
      const wordsARow = 4 * ROW;
      for (let k = 0; k < rows.length; k++) {
        const texels = Math.min(ROW, (words.length - k * wordsARow) / 4);
        const from = k * wordsARow;
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows[k], texels, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words, from);
      }
    },

    /**
     * Copy the worker's answer for a view: new pages of orders, the blocks, and the order of the near block.
     *
     * @param {FrameAnswer} answer
     */
    setFrame(answer) {
      bind(ENTRIES, entries);
      uploadPages(gl, answer.uploads);
      far.fill(answer.blocks);
      const pages = Math.ceil(answer.near.length / PAGE), rows = Math.ceil(pages / PAGES_A_ROW);
      if (rows > nearRows) {
        gl.deleteTexture(nearEntries);
        nearRows = 2 * rows;
        nearEntries = createTexture(gl, gl.R32UI, WIDTH, nearRows);
      }
      if (rows) {
        const data = new Uint32Array(rows * WIDTH);
        data.set(answer.near);
        bind(ENTRIES, nearEntries);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, rows, gl.RED_INTEGER, gl.UNSIGNED_INT, data);
      }
      close.fill(nearBlocks(pages, answer.near.length));
      setPlaces(answer.places);
      frame = answer;
    },

    /** Does anything that has arrived sway in the wind? */
    get sways() {
      return sways;
    },

    /** Blocks of the last frame. */
    get length() {
      return far.length + close.length;
    },

    /**
     * Draw blocks of the last frame over what is there, as the camera sees them now.
     *
     * @param {import("../terrain/camera.js").Camera} camera @param {DrawOptions} options
     * @param {number} [from] the first block
     * @param {number} [many] of them; all of a picture, in slices or at once, are drawn in order
     */
    draw(camera, { end, low, overlay, light, wind }, from = 0, many = far.length + close.length) {
      if (!frame) return;
      const { use, uniforms } = programs[Number(light !== null) + (stems && wind ? 2 : 0)]();
      use();
      setView(gl, uniforms, heights, manifest.tile_side, camera, frame);
      setLight(gl, uniforms, manifest, light);
      if (light && shadows) {
        bind(SHADOWS, shadows.texture);
        shadows.set(uniforms, light.shadows, camera.eye);
      }
      if (stems && wind) {
        bind(STEMS, stems);
        setWind(gl, uniforms, manifest, wind, camera.eye);
      }
      if (variation) setWavesUnder(gl, uniforms, variation, camera);
      if (heights.kind === "sphere") {
        gl.uniform1f(uniforms.begin, 0.5 * (Math.max(Math.hypot(...camera.eye) - heights.radius, 0) + end));
      }
      gl.uniform1f(uniforms.end, end);
      gl.uniform1f(uniforms.low, low);
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      bind(HUES, hues);
      if (shownOverlay !== overlay) {
        shownOverlay = overlay;
        const colours = overlayColours(overlay, manifest);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, colours);
      }
      bind(RECORDS, records);
      bind(PLACES, places);
      bind(OWNERS, owners);
      if (relief) bind(RELIEF, relief);
      gl.uniform1i(uniforms.overlay, overlay);
      bind(ENTRIES, entries);
      far.draw(from, many);
      bind(ENTRIES, nearEntries);
      close.draw(from - far.length, many);
      gl.activeTexture(gl.TEXTURE0);
      gl.bindVertexArray(null);
    },

    relief,
    /** Free the textures. */
    end() {
      for (const texture of [records, entries, nearEntries, places, hues, owners, relief, stems]) gl.deleteTexture(texture);
      if (shadows) gl.deleteTexture(shadows.texture);
    },
  };
}

/**
 * What is the same in all pictures.
 *
 * @param {GL} gl @param {Uniforms} uniforms @param {Manifest} manifest @param {HeightField} heights
 */
function setConstants(gl, uniforms, manifest, heights) {
  const { origin, step, log_scale: logScale } = manifest.encoding;
  gl.uniform3fv(uniforms.origin, origin);
  gl.uniform3fv(uniforms.stride, step);
  gl.uniform2fv(uniforms.logScale, logScale);
  gl.uniform1i(uniforms.records, RECORDS);
  gl.uniform1i(uniforms.entries, ENTRIES);
  gl.uniform1i(uniforms.hues, HUES);
  gl.uniform1i(uniforms.places, PLACES);
  gl.uniform1i(uniforms.owners, OWNERS);
  gl.uniform1i(uniforms.shadows, SHADOWS);
  gl.uniform1i(uniforms.stems, STEMS);
  gl.uniform1i(uniforms.levels, manifest.levels.length);
  gl.uniform1f(uniforms.side, manifest.tile_side);
  gl.uniform1f(uniforms.near, NEAR * manifest.eye_floor);
  gl.uniform1f(uniforms.haze, hazeOf(manifest.tile_side));
  if (heights.kind === "sphere") {
    const rate = rateOf(heights, manifest.tile_side);
    gl.uniform1f(uniforms.radius, heights.radius);
    gl.uniform1f(uniforms.rate, rate);
    gl.uniform1f(uniforms.stretch, heights.radius * rate);
  }
  setSurface(gl, uniforms, heights);
}

/** @param {number} side of a tile */
export const hazeOf = (side) => 1 / (FAR_HAZE * REACH * side);

/** @param {GL} gl @param {Uniforms} uniforms @param {HeightField} heights */
export function setSurface(gl, uniforms, heights) {
  if (heights.kind === "hills") {
    gl.uniform1i(uniforms.octaves, heights.amplitudes.length);
    gl.uniform1ui(uniforms.salt, heights.salt);
    gl.uniform1fv(uniforms["amplitude[0]"], padded(heights.amplitudes, MAX_OCTAVES));
    gl.uniform1fv(uniforms["scale[0]"], padded(heights.scales, MAX_OCTAVES));
  } else if (heights.kind === "image") {
    gl.uniform1i(uniforms.relief, RELIEF);
    gl.uniform1fv(uniforms["scale[0]"], [heights.perUnit]);
  }
}

/**
 * What depends on the view.
 *
 * @param {GL} gl @param {Uniforms} uniforms @param {HeightField} heights @param {number} side
 * @param {import("../terrain/camera.js").Camera} camera @param {FrameAnswer} frame
 */
function setView(gl, uniforms, heights, side, camera, { i0, j0, eye, switches, bands, marks }) {
  const [x, y, z] = camera.eye;
  setAxes(gl, uniforms, camera);
  gl.uniform3f(uniforms.corner, i0 * side - x, j0 * side - y, -z);
  gl.uniform2f(uniforms.halfSize, camera.width / 2, camera.height / 2);
  gl.uniform1f(uniforms.focal, camera.focal);
  gl.uniform1fv(uniforms["switches[0]"], padded(switches.slice(0, -1), MAX_LEVELS));
  gl.uniform1fv(uniforms["bands[0]"], padded(bands, MAX_LEVELS));
  gl.uniform1uiv(uniforms["marks[0]"], marks);
  if (heights.kind === "sphere") {
    setHorizon(gl, uniforms, heights, camera.eye);
    gl.uniform3fv(uniforms.moved, eye.map((v, k) => v - camera.eye[k]));
  } else setUnder(gl, uniforms, heights, camera.eye);
}

/**
 * @param {GL} gl @param {Uniforms} uniforms @param {Exclude<HeightField, import("../terrain/sphere.js").Sphere>} heights
 * @param {number[]} eye
 */
export function setUnder(gl, uniforms, heights, [x, y]) {
  if (heights.kind === "flat") return;
  const { cells, places } = heights.under(x, y);
  gl.uniform2iv(uniforms["cellUnder[0]"], cells);
  gl.uniform2fv(uniforms["placeUnder[0]"], places);
}

/** @param {GL} gl @param {Uniforms} uniforms @param {Variation} variation */
function setWaves(gl, uniforms, { waves, scales, salt }) {
  gl.uniform1uiv(uniforms["waveSeeds[0]"], waves.map((_, k) => Math.imul(VARIATION + k, 0xcb1ab31f) ^ salt));
  gl.uniform2fv(uniforms["waveScale[0]"], scales);
  gl.uniform3fv(uniforms["waveColours[0]"], waves.flatMap(({ colours }) => colours.flat()));
}

/** @param {GL} gl @param {Uniforms} uniforms @param {Variation} variation @param {import("../terrain/camera.js").Camera} camera */
function setWavesUnder(gl, uniforms, variation, { eye: [x, y] }) {
  const { cells, places } = variation.under(x, y);
  gl.uniform2iv(uniforms["waveUnder[0]"], cells);
  gl.uniform2fv(uniforms["wavePlace[0]"], places);
}

/** A function that makes a value when it is first called. @template T @param {() => T} make */
function once(make) {
  /** @type {T | undefined} */
  let made;
  return () => (made ??= make());
}

/** @param {number[]} list @param {number} length */
const padded = (list, length) => Float32Array.from({ length }, (_, k) => list[k] ?? 0);

/** @param {GL} gl @param {import("../terrain/heights.js").HeightMap} heights */
function createRelief(gl, { pixels, columns, rows }) {
  const texture = createTexture(gl, gl.R32F, columns, rows);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RED, gl.FLOAT, pixels);
  return texture;
}

/**
 * Consecutive pages of a texture row are uploaded together.
 *
 * @param {GL} gl @param {FrameAnswer["uploads"]} uploads
 */
function uploadPages(gl, { numbers, data }) {
  for (let k = 0; k < numbers.length;) {
    const first = numbers[k], place = first % PAGES_A_ROW;
    let n = 1;
    while (k + n < numbers.length && numbers[k + n] === first + n && place + n < PAGES_A_ROW) n += 1;
    const [column, row] = [place * PAGE, Math.floor(first / PAGES_A_ROW)];
    gl.texSubImage2D(gl.TEXTURE_2D, 0, column, row, n * PAGE, 1, gl.RED_INTEGER, gl.UNSIGNED_INT, data, k * PAGE);
    k += n;
  }
}

/**
 * Blocks of an instanced draw: an instance draws the PAGE Gaussians of a block as quads. Software renderers, and many a
 * GPU, have a cost for each instance, so an instance of one Gaussian would take several times as long.
 *
 * @param {GL} gl
 */
function createBlocks(gl) {
  const array = gl.createVertexArray(), buffer = gl.createBuffer();
  let count = 0;
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, QUADS, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribDivisor(0, 1);
  gl.bindVertexArray(null);
  return {
    /** @param {Uint32Array} words */
    fill(words) {
      count = words.length / BLOCK;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, words, gl.DYNAMIC_DRAW);
    },
    get length() {
      return count;
    },
    /** Draw those of blocks `from` to `from + many` that there are. @param {number} from @param {number} many */
    draw(from, many) {
      const first = Math.max(0, from), past = Math.min(count, from + many);
      if (past <= first) return;
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.vertexAttribIPointer(0, BLOCK, gl.UNSIGNED_INT, 4 * BLOCK, 4 * BLOCK * first);
      gl.drawElementsInstanced(gl.TRIANGLES, QUADS.length, gl.UNSIGNED_SHORT, 0, past - first);
    },
  };
}

/**
 * Blocks of pages 0, 1, ... of the near block's order; its entries name their cells themselves.
 *
 * @param {number} pages @param {number} count
 */
function nearBlocks(pages, count) {
  const words = new Uint32Array(BLOCK * pages);
  for (let k = 0; k < pages; k++) {
    words[BLOCK * k] = k;
    words[BLOCK * k + 1] = (Math.min(PAGE, count - k * PAGE) - 1) << 16;
  }
  return words;
}
