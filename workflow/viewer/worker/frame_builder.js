// From a view to what the GPU draws: lists of blocks of instances and of places of objects, see data/layout.js.
// Independent of the page and of messages, so worker, tests and benchmarks share it.

import {
  BLOCK, chunkKey, MAX_NEAR_PLACES, NO_ORDER, orderPages, PAGE, PLACE, PLACES, recordRows,
} from "../data/layout.js";
import { placeObjects, selectCells } from "../terrain/budget.js";
import { lookUpCell, REACH } from "../terrain/cells.js";
import { nearestOrder } from "../terrain/draw_order.js";
import { bend, dot, FACES, rateOf } from "../terrain/sphere.js";
import { createChunkStore, createSupply, WISHED } from "./chunk_store.js";
import { createNearSorter } from "./near_sort.js";
import { createBorders, createSortedBatches } from "./sorted_batches.js";
import { adjustCover, createTerrainTables, paintPoints } from "./terrain_tables.js";

/** Words of 32 bits, in items of equal size; grows. @param {number} size words of an item */
function createWordList(size) {
  let words = new Uint32Array(1024 * size), floats = new Float32Array(words.buffer), n = 0;
  return {
    clear() {
      n = 0;
    },
    /** Room for more items: all words and the index of the first new one. @param {number} more */
    extend(more) {
      if (size * (n + more) > words.length) {
        const wider = new Uint32Array(2 * size * (n + more));
        wider.set(words);
        words = wider;
        floats = new Float32Array(words.buffer);
      }
      n += more;
      return { words, floats, at: size * (n - more) };
    },
    copy: () => words.slice(0, size * n),
  };
}

/** @param {import("./terrain_tables.js").TerrainTables} terrain */
export function createDrawLists({ objects, tiles }) {
  const blocks = createWordList(BLOCK), places = createWordList(PLACE);
  return {
    clear() {
      blocks.clear();
      places.clear();
    },
    copy: () => ({ blocks: blocks.copy(), places: places.copy() }),
    /**
     * What the GPU knows of a cell or an object: tile, direction, uncertainty, whether one level stands in for all.
     *
     * @param {{ tile: number, direction: number, whole: boolean }} cell
     */
    mark: ({ tile, direction, whole }) =>
      (tile & 255) | (direction << 8) | (tiles[tile].uncertainty << 16) | ((whole ? 1 : 0) << 24),
    /**
     * Add the blocks of a batch. place: number of an object's place, counted from 1; 0: a tile.
     *
     * @param {{ di: number, dj: number }} cell @param {number} mark
     * @param {import("./sorted_batches.js").Batch} batch @param {number} [place]
     */
    addBatch({ di, dj }, mark, { pages, count }, place = 0) {
      const which = (di + 128) | ((dj + 128) << 8), { words, at } = blocks.extend(pages.length);
      for (let k = 0, w = at, left = count; k < pages.length; k++, left -= PAGE, w += BLOCK) {
        words[w] = pages[k];
        words[w + 1] = which | ((Math.min(left, PAGE) - 1) << 16);
        words[w + 2] = mark;
        words[w + 3] = place;
      }
    },
    /**
     * Add an object; returns the number of its place. level: for places in the near block.
     *
     * @param {import("../terrain/scatter.js").Thing} thing @param {number} mark @param {number} level
     */
    addThing({ x, y, cos, sin, size, number }, mark, level) {
      const { words, floats, at } = places.extend(1);
      floats.set([x, y, cos * size, sin * size, objects[number].ground, size], at);
      words[at + 6] = mark;
      words[at + 7] = level;
      return at / PLACE;
    },
    /**
     * Add a cell of a sphere; returns the number of its place.
     *
     * @param {import("../terrain/sphere_cells.js").Spot} spot @param {number} mark
     */
    addSpot({ face, s, t, centre }, mark) {
      const { words, floats, at } = places.extend(1);
      floats.set([...centre, s, t], at);
      words[at + 5] = face;
      words[at + 6] = mark;
      return at / PLACE;
    },
  };
}

/**
 * @typedef {import("../terrain/frustum.js").Cell} Cell
 * @typedef {import("../terrain/scatter.js").Thing} Thing
 * @typedef {import("../terrain/camera.js").Camera} Camera
 * @typedef {import("./terrain_tables.js").TerrainTables} TerrainTables
 * @typedef {ReturnType<typeof placeObjects>} Groups
 * @typedef {import("../terrain/budget.js").Selection} Selection
 *
 * What the GPU draws. i0, j0: the eye's cell (0 on a sphere); eye: its place; near: entries of the near block; marks: of its 9 cells; uploads: new
 * pages of orders; blocks: of far cells and objects; places: of objects; incomplete: batches were left out for lack of
 * time; work: so far.
 * @typedef {{ i0: number, j0: number, eye: number[], near: Uint32Array, marks: Uint32Array, blocks: Uint32Array, places: Uint32Array,
 *   uploads: { numbers: Uint32Array, data: Uint32Array }, incomplete: boolean, work: Work,
 *   milliseconds: { update: number, sort: number } }} FrameArrays
 * @typedef {import("../terrain/budget.js").Selection & FrameArrays} Frame
 *
 * Gaussians so far that were tested for staying in a cell, composed, and sorted for a batch; batches that were late so
 * far, and that are kept; bytes of the chunks at hand.
 * @typedef {{ tested: number, composed: number, sorted: number, late: number, batches: number, bytes: number }} Work
 *
 * A frame as the worker posts it. drawn: six numbers a cell (di, dj, tile, lo, hi, direction).
 * @typedef {Omit<Frame, "cells" | "missing"> & { id: number, patient: boolean, missing: number[],
 *   drawn: Int32Array }} FrameAnswer
 */

/** @type {Thing[]} */
const NONE = [];
const MIDDLE = { di: 0, dj: 0 }; // an object's place does not count from its block's cell
const WINDOW = 2 * REACH + 1; // cells along the side of the window about the eye
const COVER = 16; // cells of it that are covered in one step
const TIME_LIMIT = 4; // milliseconds of making batches in an update that somebody waits for
const BORDER_LIMIT = 0.2; // milliseconds of making those of single cells, which all have a substitute

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights @param {import("./chunk_store.js").Handlers} [handlers]
 */
export function createFrameBuilder(manifest, heights, handlers = {}) {
  const terrain = createTerrainTables(manifest, heights);
  const store = createChunkStore(terrain, recordRows(manifest), (tile) => batches.forget(tile));
  const borders = createBorders(terrain, store);
  const batches = createSortedBatches(store, terrain, borders, orderPages(manifest));
  const sortNear = createNearSorter(store, terrain, borders);
  const lists = createDrawLists(terrain);
  const levels = new Uint16Array(terrain.tiles.length); // bits
  let stamp = 0;
  const ahead = { i0: 0, j0: 0, next: WINDOW ** 2 }; // of the window about the eye, the next cell to cover
  const supply = createSupply(manifest, terrain, store, handlers);
  /** @type {Cell[]} */
  let drawn = []; // cells of the last view, until it is prepared for the next

  /** Prepare for the next view where tiles are uncertain: finer levels, neighbouring orders. Returns: is there any? */
  function prepare() {
    /** @type {Set<number>} */
    const keys = new Set();
    for (let k = drawn.length - 1; k >= 0; k--) {
      const { close, border, tile, tiles, lo, hi, direction } = drawn[k], { all, orders } = terrain.tiles[tile];
      if (!all) continue;
      if (lo) keys.add(chunkKey(tile, lo - 1));
      if (close || border) continue;
      const source = { tile, tiles, border, lo, hi };
      for (const next of terrain.nearest[direction]) batches.prepare(source, orders.indexOf(next));
    }
    supply.prepare([...keys]);
    const many = drawn.length;
    drawn = [];
    return many > 0;
  }

  /** Mark the chunks that are drawn, and those that the view needs. @param {Cell[]} cells @param {Groups} groups */
  function touch(cells, groups) {
    levels.fill(0);
    for (let k = 0; k < cells.length; k++) {
      const { tiles, lo, hi } = cells[k], group = groups[k], bits = (2 << hi) - (1 << lo);
      for (let n = 0; n < tiles.length; n++) levels[tiles[n]] |= bits;
      for (let n = 0; group && n < group.length; n++) levels[group[n].tile] |= (2 << group[n].hi) - (1 << group[n].lo);
    }
    for (let tile = 0; tile < levels.length; tile++) mark(tile, levels[tile], stamp);
    touchWish();
  }

  /** Mark the chunks that the view needs, where not all fit. */
  function touchWish() {
    for (let tile = 0; terrain.room && tile < levels.length; tile++) {
      mark(tile, terrain.wish[tile] & terrain.tiles[tile].arrived, stamp + WISHED);
    }
  }

  /** Mark chunks of a tile as used. @param {number} tile @param {number} bits of levels @param {number} at a stamp */
  function mark(tile, bits, at) {
    for (let level = 0; bits >> level; level++) if ((bits >> level) & 1) store.touch(tile, level, at);
  }

  /**
   * The cells of the near block, what the GPU knows of them, and the objects that are drawn with them: the nearest ones
   * as far as there are codes, and the rest.
   *
   * @param {Cell[]} cells @param {Groups} groups
   */
  function gatherNear(cells, groups) {
    const close = [], marks = new Uint32Array(9), things = [];
    for (let k = 0; k < cells.length; k++) {
      const cell = cells[k];
      if (!cell.close) continue;
      cell.direction = NO_ORDER;
      if (cell.spot) lists.addSpot(cell.spot, lists.mark(cell)); // place k is that of the k-th close cell
      else marks[(cell.dj + 1) * 3 + cell.di + 1] = lists.mark(cell);
      close.push(cell);
      things.push(...groups[k] ?? NONE);
    }
    things.sort((a, b) => a.distance - b.distance);
    /** @type {import("./near_sort.js").NearThing[]} */
    const near = [];
    let room = MAX_NEAR_PLACES;
    for (const thing of things) {
      const many = thing.hi - thing.lo + 1;
      if (room < many) break;
      room -= many;
      const mark = lists.mark(thing);
      near.push({
        thing, codes: Array.from({ length: many }, (_, l) => PLACES + lists.addThing(thing, mark, thing.lo + l)),
      });
    }
    return { close, marks, near, rest: things.slice(near.length).reverse() };
  }

  /**
   * Batches of the far cells, by index; made from the nearest on, which matter most when time is short.
   *
   * @param {Cell[]} cells @param {number[]} eye
   * @param {import("./sorted_batches.js").IsLate} isLate
   */
  function getBatches(cells, eye, isLate) {
    const i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
    /** @type {(import("./sorted_batches.js").Batch | null)[]} */
    const made = new Array(cells.length).fill(null);
    for (let k = cells.length - 1; k >= 0; k--) {
      const cell = cells[k];
      if (cell.close) continue;
      const order = orderOf(cell, terrain, eye, i0, j0);
      cell.direction = terrain.tiles[cell.tile].orders[order];
      made[k] = batches.get(cell, order, stamp, isLate);
    }
    return made;
  }

  /** Add objects to the blocks. @param {Thing[]} things @param {import("./sorted_batches.js").IsLate} isLate */
  function addThings(things, isLate) {
    for (let k = 0; k < things.length; k++) {
      const thing = things[k], batch = batches.get(thing, thing.order, stamp, isLate);
      if (!batch) continue;
      const mark = lists.mark(thing);
      lists.addBatch(MIDDLE, mark, batch, 1 + lists.addThing(thing, mark, thing.lo));
    }
  }

  /**
   * What a view shows of the chunks at hand; a patient one composes what it lacks.
   *
   * @param {Camera} camera @param {number} budget @param {boolean} patient
   */
  function select(camera, budget, patient) {
    if (patient) supply.finish();
    supply.begin(stamp);
    for (;;) {
      const selection = selectCells(terrain, camera, budget), groups = placeObjects(terrain, camera, selection);
      supply.want(selection);
      drawn = selection.cells;
      if (patient) touchWish(); // what is composed must not evict it
      if (!patient || !supply.bringWanted()) return { selection, groups };
    }
  }

  /** Cover the next cells of the window about the eye. Returns: were there any? */
  function coverAhead() {
    const { i0, j0, next } = ahead, end = Math.min(next + COVER, WINDOW ** 2);
    if (next >= end || terrain.sphere) return false;
    const west = i0 - REACH, south = j0 - REACH;
    for (let k = next; k < end; k++) lookUpCell(terrain, west + (k % WINDOW), south + Math.floor(k / WINDOW));
    ahead.next = end;
    return true;
  }

  return {
    store,
    batches,
    supply,
    get work() {
      const { tested } = borders, { composed } = supply, { sorted, late, size } = batches;
      return { tested, composed, sorted, late, batches: size, bytes: store.bytes };
    },
    /** @param {Int32Array} points see `paintPoints` */
    paint: (points) => paintPoints(terrain, points),
    /** @param {import("./worker.js").Changes} changes */
    adjust: (changes) => adjustCover(terrain, changes),
    /**
     * Work ahead between two views: batches that were late for the last view, parts that came, chunks that it lacks,
     * cells about its eye that have not been in view yet, what may be needed next. Returns: is there more to do?
     *
     * @param {number} milliseconds about as long
     */
    workAhead(milliseconds) {
      const end = performance.now() + milliseconds;
      while (performance.now() < end) {
        if (!batches.makeDue(stamp) && !supply.advance() && !coverAhead() && !prepare()) return false;
      }
      return true;
    },
    /**
     * The frame of a view.
     *
     * @param {Camera} camera @param {number} budget
     * @param {boolean} patient compose every chunk whose parts are there and make every batch, however long that takes
     * @returns {Frame}
     */
    build(camera, budget, patient) {
      const start = performance.now();
      stamp += 1;
      batches.begin();
      const { eye } = camera, i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
      if (i0 !== ahead.i0 || j0 !== ahead.j0 || stamp === 1) Object.assign(ahead, { i0, j0, next: 0 });
      const { selection, groups } = select(camera, budget, patient), { cells } = selection;
      let incomplete = false;
      /** @type {import("./sorted_batches.js").IsLate} */
      const isLate = (border, spent) => {
        const late = !patient && (border ? spent > BORDER_LIMIT : performance.now() - start > TIME_LIMIT);
        incomplete ||= late;
        return late;
      };
      touch(cells, groups);
      lists.clear();
      const { close, marks, near: things, rest } = gatherNear(cells, groups);
      const made = getBatches(cells, eye, isLate);
      for (let k = 0; k < cells.length; k++) {
        const cell = cells[k], batch = made[k];
        if (cell.close) continue;
        const mark = lists.mark(cell);
        if (batch && cell.spot) lists.addBatch(MIDDLE, mark, batch, 1 + lists.addSpot(cell.spot, mark));
        else if (batch) lists.addBatch(cell, mark, batch);
        addThings(groups[k] ?? NONE, isLate);
      }
      addThings(rest, isLate);
      const uploads = batches.takeUploads(), updated = performance.now();
      const near = sortNear(close, camera, selection, things);
      return {
        ...selection, ...lists.copy(), i0: terrain.sphere ? 0 : i0, j0: terrain.sphere ? 0 : j0, eye, near, marks,
        uploads, incomplete, work: this.work,
        milliseconds: { update: updated - start, sort: performance.now() - updated },
      };
    },
  };
}

/**
 * The order of a cell's batch: position among those of its tile.
 *
 * @param {Cell} cell @param {TerrainTables} terrain @param {number[]} eye @param {number} i0
 * @param {number} j0
 */
function orderOf(cell, { side, cache, z, directions, tiles, sphere }, eye, i0, j0) {
  const { at } = cell;
  if (sphere && cell.spot) {
    return nearestOrder(directions, tiles[cell.tile].orders, lookAlong(sphere, side, cell.spot, z), 0, 0);
  }
  const to = [
    (i0 + cell.di + 0.5) * side - eye[0], (j0 + cell.dj + 0.5) * side - eye[1],
    cache.h[at] + 0.5 * (z[0] + z[1]) - eye[2],
  ];
  return nearestOrder(directions, tiles[cell.tile].orders, to, cache.east[at], cache.north[at]);
}

/**
 * The direction to a cell of a sphere as its own Gaussians have it, before they are bent: depths along it rise as those
 * along the direction from the eye to the tile's middle do.
 *
 * @param {import("../terrain/sphere.js").Sphere} sphere @param {number} side
 * @param {import("../terrain/sphere_cells.js").Spot} spot
 * @param {number[]} z range of heights
 */
function lookAlong(sphere, side, { face, s, t, centre }, z) {
  const middle = 0.5 * (z[0] + z[1]), made = bend(0, 0, middle, s, t, sphere.radius, rateOf(sphere, side), []);
  const to = FACES[face].map((axis, k) => dot(axis, centre) + made[k]);
  return [3, 6, 9].map((at) => dot(made.slice(at, at + 3), to));
}
