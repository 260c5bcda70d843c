// Gaussians on the GPU: all records in one texture, orders in pages of another, and two instanced draws a picture, one
// for all far tiles and one for the 3 x 3 about the eye. A block of instances is a page of entries in one cell.

import { program } from "./gl.js";
import { MOST_OCTAVES } from "./heights.js";
import { huesOf } from "./overlay.js";
import { setEncoding } from "./records.js";
import { LEVELS, PAGE } from "./runs.js";
import { FRAGMENT, PAGES_A_ROW, vertexShader } from "./shader.js";
import { PageError } from "./source.js";
import { ROW, rowsFor } from "./store.js";
import { NEAR } from "./terrain.js";
import { BLOCK, pagesFor } from "./update.js";

const FULL = "The terrain does not fit into this machine's graphics memory. Close other pages, make one with larger "
  + "tiles or fewer variants, or open it on a larger machine.";
const WIDTH = PAGE * PAGES_A_ROW; // of the order textures

export function createSplats(gl, manifest, heights) {
  const { use, uniforms } = program(gl, vertexShader(heights.kind), FRAGMENT);
  const tallest = Math.max(rowsFor(manifest), pagesFor(manifest) / PAGES_A_ROW);
  if (tallest > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new PageError(FULL);
  const records = texture(gl, gl.RGBA32UI, ROW, rowsFor(manifest));
  const entries = texture(gl, gl.R32UI, WIDTH, pagesFor(manifest) / PAGES_A_ROW);
  const far = createBlocks(gl), close = createBlocks(gl);
  let nearEntries = texture(gl, gl.R32UI, WIDTH, 1), nearRows = 1, frame = null;
  const constants = () => {
    setEncoding(gl, uniforms, manifest.encoding);
    gl.uniform1i(uniforms.records, 0);
    gl.uniform1i(uniforms.entries, 1);
    gl.uniform1i(uniforms.hues, 3);
    gl.uniform1i(uniforms.levels, manifest.levels.length);
    gl.uniform1f(uniforms.side, manifest.tile_side);
    gl.uniform1f(uniforms.near, NEAR * manifest.eye_floor);
    gl.uniform3fv(uniforms.zenith, manifest.sky.zenith);
    gl.uniform3fv(uniforms.horizon, manifest.sky.horizon);
    gl.uniform3fv(uniforms.ground, manifest.ground_colour);
    if (heights.kind === "hills") {
      gl.uniform1i(uniforms.octaves, heights.amplitudes.length);
      gl.uniform1ui(uniforms.salt, heights.salt);
      gl.uniform1fv(uniforms["amplitude[0]"], padded(heights.amplitudes, MOST_OCTAVES));
      gl.uniform1fv(uniforms["scale[0]"], padded(heights.scales, MOST_OCTAVES));
    } else if (heights.kind === "image") {
      gl.uniform1i(uniforms.relief, 2);
      gl.uniform1i(uniforms.mirrored, heights.mirrored);
      gl.uniform1fv(uniforms["scale[0]"], [heights.perUnit]);
    }
  };
  const relief = heights.kind === "image" ? reliefTexture(gl, heights) : null;
  const hues = texture(gl, gl.RGBA8, 256, 1);
  let shown = -1;
  if (gl.getError() === gl.OUT_OF_MEMORY) throw new PageError(FULL);

  function bind(unit, which) {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, which);
  }

  return {
    /** Bring a chunk's records to their rows. */
    add({ rows, records: words }) {
      bind(0, records);
      const wordsARow = 4 * ROW;
      for (let k = 0; k < rows.length; k++) {
        const texels = Math.min(ROW, (words.length - k * wordsARow) / 4);
        const layout = [gl.RGBA_INTEGER, gl.UNSIGNED_INT];
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows[k], texels, 1, ...layout, words, k * wordsARow);
      }
    },

    /** Bring what the worker made of a view: new pages of orders, the blocks, and the near order. */
    take(made) {
      bind(1, entries);
      uploadPages(gl, made.uploads);
      far.fill(made.blocks);
      const pages = Math.ceil(made.near.length / PAGE), rows = Math.ceil(pages / PAGES_A_ROW);
      if (rows > nearRows) {
        gl.deleteTexture(nearEntries);
        nearEntries = texture(gl, gl.R32UI, WIDTH, (nearRows = 2 * rows));
      }
      if (rows) {
        const data = new Uint32Array(rows * WIDTH);
        data.set(made.near);
        bind(1, nearEntries);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, WIDTH, rows, gl.RED_INTEGER, gl.UNSIGNED_INT, data);
      }
      close.fill(nearBlocks(pages, made.near.length));
      frame = made;
    },

    /** Draw what was last taken, as the camera sees it now, over what the picture already shows. */
    draw(camera, { end, low, overlay }) {
      if (!frame) return;
      use();
      constants();
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      for (const axis of ["right", "up", "ahead"]) gl.uniform3fv(uniforms[axis], camera[axis]);
      const [x, y, z] = camera.eye, { i0, j0, switches, bands } = frame, side = manifest.tile_side;
      gl.uniform3f(uniforms.corner, i0 * side - x, j0 * side - y, -z);
      gl.uniform2f(uniforms.halfSize, camera.width / 2, camera.height / 2);
      gl.uniform1f(uniforms.focal, camera.focal);
      gl.uniform1f(uniforms.end, end);
      gl.uniform1f(uniforms.low, low);
      gl.uniform1fv(uniforms["changes[0]"], padded(switches.slice(0, -1), LEVELS));
      gl.uniform1fv(uniforms["bands[0]"], padded(bands, LEVELS));
      gl.uniform1uiv(uniforms["marks[0]"], frame.marks);
      gl.uniform1i(uniforms.overlay, overlay);
      bind(3, hues);
      if (shown !== overlay) {
        const colours = huesOf((shown = overlay), manifest);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 1, gl.RGBA, gl.UNSIGNED_BYTE, colours);
      }
      if (heights.under) {
        const { cells, places } = heights.under(x, y);
        gl.uniform2iv(uniforms["cellUnder[0]"], cells);
        gl.uniform2fv(uniforms["placeUnder[0]"], places);
      }
      bind(0, records);
      if (relief) bind(2, relief);
      bind(1, entries);
      far.draw();
      bind(1, nearEntries);
      close.draw();
      gl.activeTexture(gl.TEXTURE0);
      gl.bindVertexArray(null);
    },

    /** Give the memory back. */
    end() {
      for (const made of [records, entries, nearEntries, hues, relief]) gl.deleteTexture(made);
    },
  };
}

const padded = (list, length) => Float32Array.from({ length }, (_, k) => list[k] ?? 0);

function texture(gl, format, width, height) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const side of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, side, gl.NEAREST);
  return made;
}

function reliefTexture(gl, { pixels, columns, rows }) {
  const made = texture(gl, gl.R32F, columns, rows);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, columns, rows, gl.RED, gl.FLOAT, pixels);
  return made;
}

/** Pages one after the other in a row of the texture go up together. */
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

/** Blocks for an instanced draw: each serves PAGE instances. */
function createBlocks(gl) {
  const array = gl.createVertexArray(), buffer = gl.createBuffer();
  let count = 0;
  gl.bindVertexArray(array);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
  gl.enableVertexAttribArray(0);
  gl.vertexAttribIPointer(0, 3, gl.UNSIGNED_INT, 4 * BLOCK, 0);
  gl.vertexAttribDivisor(0, PAGE);
  gl.bindVertexArray(null);
  return {
    fill(words) {
      count = words.length / BLOCK;
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, words, gl.DYNAMIC_DRAW);
    },
    draw() {
      if (!count) return;
      gl.bindVertexArray(array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count * PAGE);
    },
  };
}

/** Pages 0, 1, ... of the near order; entries name their cells themselves. */
function nearBlocks(pages, count) {
  const words = new Uint32Array(BLOCK * pages);
  for (let k = 0; k < pages; k++) {
    words[BLOCK * k] = k;
    words[BLOCK * k + 1] = (Math.min(PAGE, count - k * PAGE) - 1) << 16;
  }
  return words;
}
