// A tile's Gaussians and their orders, for renderers of others. Decoded as draw/shaders.js decodes them.

import { readChunks } from "../data/bundle.js";
import { chunkKey, listChunks } from "../data/layout.js";
import { deviationOf, MAX_TURN, parseChunk, TURN_STEPS } from "../data/records.js";
import { checkIndex } from "./arguments.js";

/**
 * @typedef {import("../scene/open_terrain.js").OpenTerrain} OpenTerrain
 * @typedef {{ count: number, centres: Float32Array, deviations: Float32Array, turns: Float32Array,
 *   colours: Float32Array }} Gaussians
 * @typedef {{ number: number, direction: number[], indices: Uint16Array | Uint32Array }} Order
 */

/** @param {Pick<OpenTerrain, "manifest" | "source">} terrain */
export function createChunkReader({ manifest, source }) {
  const chunks = listChunks(manifest), { tiles, objects = [], levels, encoding, directions } = manifest;
  /** @type {{ key: number, chunk: Promise<import("../data/bundle.js").Chunk> } | null} */
  let last = null;

  /** @param {number} tile @param {number} level */
  async function read(tile, level) {
    checkIndex("tile", tile, tiles.length + objects.length);
    checkIndex("level", level, levels.length);
    const key = chunkKey(tile, level), found = chunks.filter((one) => chunkKey(one.tile, one.entry.level) === key);
    if (last?.key !== key) {
      /** @type {Promise<import("../data/bundle.js").Chunk>} */
      const chunk = new Promise((take, refuse) => readChunks(found, source, { take }).catch(refuse));
      last = { key, chunk };
      chunk.catch(() => (last = null));
    }
    const { buffer, count } = await last.chunk;
    return { ...parseChunk(buffer, count, encoding), count, kept: found[0].entry.orders };
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
      const { orders, count, kept } = await read(tile, level);
      return kept.map((number, k) => ({
        number, direction: directions[number], indices: orders.slice(k * count, (k + 1) * count),
      }));
    },
  };
}

/**
 * Shapes and colours of records: standard deviations, quaternions w x y z, red green blue opacity from 0 to 1.
 *
 * @param {Uint32Array} records
 * @param {number} count
 * @param {import("../data/records.js").Encoding} encoding
 */
export function decodeRecords(records, count, encoding) {
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
