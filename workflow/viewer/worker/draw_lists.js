// Lists that the GPU draws from: blocks of instances, and places of objects. Layout: data/layout.js.

import { BLOCK, PAGE, PLACE } from "../data/layout.js";

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
