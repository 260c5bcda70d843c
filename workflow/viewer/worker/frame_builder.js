// From a view to what the GPU draws. Independent of the page and of messages, so worker, tests and benchmarks share it.

import { BLOCK, NO_ORDER, orderPages, PAGE, recordRows } from "../data/layout.js";
import { selectCells } from "../terrain/budget.js";
import { nearestOrder } from "../terrain/draw_order.js";
import { createChunkStore } from "./chunk_store.js";
import { createNearSorter } from "./near_sort.js";
import { createSortedBatches } from "./sorted_batches.js";
import { createTerrainTables } from "./terrain_tables.js";

/**
 * @typedef {import("../terrain/frustum.js").Cell} Cell
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {import("./terrain_tables.js").TerrainTables} TerrainTables
 *
 * What the GPU draws. i0, j0: the eye's cell; near: entries of the near block; marks: of its 9 cells; uploads: new pages
 * of orders; blocks: of far cells; incomplete: batches were left out for lack of time.
 * @typedef {{ i0: number, j0: number, near: Uint32Array, marks: Uint32Array, blocks: Uint32Array,
 *   uploads: { numbers: Uint32Array, data: Uint32Array }, incomplete: boolean,
 *   milliseconds: { update: number, sort: number } }} FrameArrays
 * @typedef {import("../terrain/budget.js").Selection & FrameArrays} Frame
 *
 * A frame as the worker posts it. drawn: six numbers a cell (di, dj, tile, lo, hi, direction); bytes: of all chunks.
 * @typedef {Omit<Frame, "cells" | "missing"> & { id: number, patient: boolean, missing: number[], bytes: number,
 *   drawn: Int32Array }} FrameAnswer
 */

const TIME_LIMIT = 4; // milliseconds of making batches in an update that somebody waits for

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 */
export function createFrameBuilder(manifest, heights) {
  const terrain = createTerrainTables(manifest, heights);
  const store = createChunkStore(terrain, manifest, recordRows(manifest), (tile) => batches.forget(tile));
  const batches = createSortedBatches(store, terrain, orderPages(manifest));
  const sortNear = createNearSorter(store, terrain), blocks = createBlockList(terrain);
  const levels = new Uint16Array(terrain.tiles.length); // bits
  let stamp = 0;

  /** Mark the chunks of these cells as drawn. @param {Cell[]} cells */
  function touch(cells) {
    levels.fill(0);
    for (const { tile, lo, hi } of cells) levels[tile] |= (2 << hi) - (1 << lo);
    for (let tile = 0; tile < levels.length; tile++) {
      for (let level = 0; levels[tile] >> level; level++) if ((levels[tile] >> level) & 1) store.touch(tile, level, stamp);
    }
  }

  return {
    store,
    batches,
    /** @param {import("../data/bundle.js").Chunk} chunk */
    add: (chunk) => store.add(chunk, stamp),
    /**
     * The frame of a view.
     *
     * @param {Camera} camera
     * @param {number} budget
     * @param {boolean} patient make every batch, however long that takes
     * @returns {Frame}
     */
    build(camera, budget, patient) {
      const start = performance.now();
      stamp += 1;
      const { eye } = camera, i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
      const selection = selectCells(terrain, camera, budget), close = [], marks = new Uint32Array(9);
      let incomplete = false;
      const isLate = () => {
        const late = !patient && performance.now() - start > TIME_LIMIT;
        incomplete ||= late;
        return late;
      };
      touch(selection.cells);
      blocks.clear();
      for (const cell of selection.cells) {
        if (cell.close) {
          cell.direction = NO_ORDER;
          marks[(cell.dj + 1) * 3 + cell.di + 1] = cellMark(cell, terrain);
          close.push(cell);
          continue;
        }
        const order = orderOf(cell, terrain, eye, i0, j0);
        cell.direction = terrain.tiles[cell.tile].orders[cell.lo][order];
        const pages = batches.get(cell, order, stamp, isLate);
        if (pages) blocks.add(cell, pages);
      }
      const uploads = batches.takeUploads(), updated = performance.now();
      const near = sortNear(close, camera, selection);
      return {
        ...selection, i0, j0, near, marks, uploads, incomplete, blocks: blocks.words(),
        milliseconds: { update: updated - start, sort: performance.now() - updated },
      };
    },
  };
}

/**
 * The order of a cell's batch: position among those that its finest drawn level keeps, which all its levels do.
 *
 * @param {Cell} cell
 * @param {TerrainTables} terrain
 * @param {number[]} eye
 * @param {number} i0
 * @param {number} j0
 */
function orderOf(cell, { side, cache, z, directions, tiles }, eye, i0, j0) {
  const { at } = cell;
  const to = [
    (i0 + cell.di + 0.5) * side - eye[0], (j0 + cell.dj + 0.5) * side - eye[1],
    cache.h[at] + 0.5 * (z[0] + z[1]) - eye[2],
  ];
  return nearestOrder(directions, tiles[cell.tile].orders[cell.lo], to, cache.east[at], cache.north[at]);
}

/**
 * A list of blocks that grows.
 *
 * @param {TerrainTables} terrain
 */
function createBlockList(terrain) {
  let words = new Uint32Array(BLOCK * 4096), n = 0;
  return {
    clear() {
      n = 0;
    },
    /** @param {Cell} cell @param {Uint32Array} pages */
    add(cell, pages) {
      const which = (cell.di + 128) | ((cell.dj + 128) << 8), mark = cellMark(cell, terrain);
      if (BLOCK * (n + pages.length) > words.length) {
        const more = new Uint32Array(2 * BLOCK * (n + pages.length));
        more.set(words);
        words = more;
      }
      let left = cell.count;
      for (let k = 0, at = BLOCK * n; k < pages.length; k++, left -= PAGE, at += BLOCK) {
        words[at] = pages[k];
        words[at + 1] = which | ((Math.min(left, PAGE) - 1) << 16);
        words[at + 2] = mark;
      }
      n += pages.length;
    },
    words: () => words.slice(0, BLOCK * n),
  };
}

/**
 * What the GPU knows of a cell: tile, direction, uncertainty, and whether one level stands there for all.
 *
 * @param {Cell} cell
 * @param {TerrainTables} terrain
 */
function cellMark({ tile, direction, whole }, terrain) {
  const uncertainty = Math.round(255 * Math.min(Math.max(terrain.tiles[tile].uncertainty, 0), 1));
  return tile | (direction << 8) | (uncertainty << 16) | (Number(whole) << 24);
}
