// Lists that the GPU draws from: blocks of instances, and places of objects. Layout: data/layout.js.

import { BLOCK, PAGE, PLACE } from "../data/layout.js";

/**
 * Words of 32 bits, in items of equal size; grows.
 *
 * @param {number} size words of an item
 */
function createWordList(size) {
  let words = new Uint32Array(1024 * size), floats = new Float32Array(words.buffer), n = 0;
  return {
    clear() {
      n = 0;
    },
    /** Number of items. */
    get length() {
      return n;
    },
    /** Room for more items; the index of the first of their words. @param {number} more */
    extend(more) {
      if (size * (n + more) > words.length) {
        const wider = new Uint32Array(2 * size * (n + more));
        wider.set(words);
        words = wider;
        floats = new Float32Array(words.buffer);
      }
      n += more;
      return size * (n - more);
    },
    /** The words as integers and as floats; valid until the next `extend`. */
    get words() {
      return words;
    },
    get floats() {
      return floats;
    },
    copy: () => words.slice(0, size * n),
  };
}

/** Blocks of far cells and objects. */
export function createBlockList() {
  const list = createWordList(BLOCK);
  return {
    clear: list.clear,
    copy: list.copy,
    /**
     * Add a batch.
     *
     * @param {{ di: number, dj: number }} cell
     * @param {number} mark see `cellMark`
     * @param {import("./sorted_batches.js").Batch} batch
     * @param {number} [place] number of an object's place, counted from 1; 0: a tile
     */
    add({ di, dj }, mark, { pages, count }, place = 0) {
      const which = (di + 128) | ((dj + 128) << 8), at = list.extend(pages.length), { words } = list;
      for (let k = 0, w = at, left = count; k < pages.length; k++, left -= PAGE, w += BLOCK) {
        words[w] = pages[k];
        words[w + 1] = which | ((Math.min(left, PAGE) - 1) << 16);
        words[w + 2] = mark;
        words[w + 3] = place;
      }
    },
  };
}

/**
 * Places of objects: those of the near block first.
 *
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 */
export function createPlaceList({ objects }) {
  const list = createWordList(PLACE);
  return {
    clear: list.clear,
    copy: list.copy,
    /**
     * Add an object; returns the number of its place.
     *
     * @param {import("../terrain/scatter.js").Thing} thing
     * @param {number} mark see `cellMark`
     * @param {number} level for places in the near block
     */
    add({ x, y, cos, sin, size, number }, mark, level) {
      const at = list.extend(1), { words, floats } = list;
      floats[at] = x;
      floats[at + 1] = y;
      floats[at + 2] = cos * size;
      floats[at + 3] = sin * size;
      floats[at + 4] = objects[number].ground;
      floats[at + 5] = size;
      words[at + 6] = mark;
      words[at + 7] = level;
      return at / PLACE;
    },
    /**
     * Add a cell of a sphere; returns the number of its place.
     *
     * @param {import("../terrain/sphere_cells.js").Spot} spot
     * @param {number} mark see `cellMark`
     */
    addSpot({ face, s, t, centre }, mark) {
      const at = list.extend(1), { words, floats } = list;
      floats.set(centre, at);
      floats[at + 3] = s;
      floats[at + 4] = t;
      words[at + 5] = face;
      words[at + 6] = mark;
      return at / PLACE;
    },
  };
}

/**
 * What the GPU knows of a cell or an object: tile, direction, uncertainty, and whether one level stands there for all.
 *
 * @param {{ tile: number, direction: number, whole: boolean }} cell
 * @param {import("./terrain_tables.js").TerrainTables} terrain
 */
export function cellMark({ tile, direction, whole }, { tiles }) {
  return (tile & 255) | (direction << 8) | (tiles[tile].uncertainty << 16) | ((whole ? 1 : 0) << 24);
}
