// Tables of a terrain for the worker: sizes and orders of its tiles, level distances, quantization.

import { NEAR } from "../data/layout.js";
import { deviationOf } from "../data/records.js";
import { createCellCache } from "../terrain/cells.js";

/**
 * A tile. counts, orders: by level; arrived: bits of the levels at hand.
 * @typedef {{ z: number[], uncertainty: number, arrived: number, counts: number[], orders: number[][] }} TileTable
 *
 * cells: objects that each view uses again; deviations: standard deviation by byte.
 * @typedef {{ side: number, salt: number, directions: number[][], variants: number, levels: number, tiles: TileTable[],
 *   heights: import("../terrain/heights.js").HeightField, largest: number, deviations: ArrayLike<number>,
 *   switches: number[], bands: number[], z: number[], near: number, cache: import("../terrain/cells.js").CellCache,
 *   cells: import("../terrain/frustum.js").Cell[] }} TerrainTables
 */

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 * @returns {TerrainTables}
 */
export function createTerrainTables(manifest, heights) {
  const { tile_side: side, salt, levels, directions, encoding } = manifest;
  const tiles = manifest.tiles.map(({ z, chunks, uncertainty }) => {
    const byLevel = [...chunks].sort((a, b) => a.level - b.level);
    return {
      z, uncertainty: uncertainty ?? 0, arrived: 0,
      counts: byLevel.map((chunk) => chunk.count), orders: byLevel.map((chunk) => chunk.orders),
    };
  });
  return {
    side, salt, directions, heights, tiles, variants: tiles.length / 16, levels: levels.length,
    largest: deviationOf(encoding, 255),
    deviations: Float64Array.from({ length: 256 }, (_, byte) => deviationOf(encoding, byte)),
    switches: levels.map(({ distance }) => distance ?? Infinity), bands: levels.map(({ band }) => band ?? 0),
    z: [Math.min(...tiles.map((tile) => tile.z[0])), Math.max(...tiles.map((tile) => tile.z[1]))],
    near: NEAR * manifest.eye_floor, cache: createCellCache(), cells: [],
  };
}
