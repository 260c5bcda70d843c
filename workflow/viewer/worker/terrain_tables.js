// Tables of a terrain for the worker: sizes and orders of its tiles and objects, level distances, classes, scatter; and
// what painting changes of them.

import { chunkBytes, deviationOf, NEAR, ROW, shareOfRange, uncertaintyRange, viewRoom } from "../data/layout.js";
import { RING } from "../terrain/caches.js";
import { createCellCache, forgetCells } from "../terrain/cells.js";
import { createClasses } from "../terrain/classes.js";
import { RIM } from "../terrain/frustum.js";
import { createScatter } from "../terrain/scatter.js";
import { dot } from "../terrain/sphere.js";
import { createSphereCells } from "../terrain/sphere_cells.js";
import { createFraying } from "../terrain/sphere_edges.js";

/**
 * A tile, or an object: these are numbered after the tiles. uncertainty: in 255ths of the set's range; counts: by
 * level, as are bytes and rows of the record texture; orders: the directions that it is sorted for; all: are these all
 * that there are, as of uncertain tiles? arrived: bits of the levels at hand; alone: a list of its own number.
 * @typedef {{ uncertainty: number, arrived: number, counts: number[], orders: number[], all: boolean,
 *   bytes: number[], rows: number[], alone: number[] }} TileTable
 *
 * An object. ground: z of the foot; extent: largest distance of a Gaussian's rim from the foot, as far as is known.
 * @typedef {{ ground: number, extent: number }} ObjectTable
 *
 * What tells which Gaussians stay in a cell where materials, or faces of a sphere, meet.
 * @typedef {{ keep: (i: number, j: number, chunk: { centres: Float32Array, count: number },
 *   material: number) => Uint32Array }} Keeper
 *
 * sphere, sphereCells: null on a plane. variants: centres of a material's tiles; each: tiles of a material; z: range of heights of tiles, rims included;
 * most: largest size of an object; cells, window: arrays that each view uses again; deviations: standard deviation by
 * byte. nearest: of each direction the two next to it; room: what a view may use of the cache, or null if all chunks fit; wish: bits of the levels of each tile and
 * object that the last view needs, where room limits it.
 * @typedef {{ side: number, salt: number, directions: number[][], nearest: number[][], variants: number, each: number, levels: number,
 *   tiles: TileTable[], objects: ObjectTable[], classes: import("../terrain/classes.js").Classes | null,
 *   scatter: import("../terrain/scatter.js").Scatter | null, most: number,
 *   heights: import("../terrain/heights.js").HeightField, largest: number, deviations: ArrayLike<number>,
 *   switches: number[], bands: number[], z: number[], near: number, cache: import("../terrain/cells.js").CellCache,
 *   cells: import("../terrain/frustum.js").Cell[], window: Int32Array, sphere: import("../terrain/sphere.js").Sphere | null,
 *   sphereCells: ReturnType<typeof createSphereCells> | null, keeper: Keeper | null,
 *   room: { bytes: number, rows: number } | null, wish: Uint16Array }} TerrainTables
 */

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {import("../terrain/heights.js").HeightField} heights
 * @returns {TerrainTables}
 */
export function createTerrainTables(manifest, heights) {
  const { tile_side: side, salt, levels, directions, encoding, materials, objects = [], scatter } = manifest;
  const range = uncertaintyRange(manifest.tiles);
  const owners = [...manifest.tiles, ...objects.map((object) => ({ ...object, uncertainty: range[0] }))];
  const tiles = owners.map(({ chunks, orders, uncertainty }, number) => {
    const byLevel = [...chunks].sort((a, b) => a.level - b.level);
    return {
      uncertainty: Math.round(255 * shareOfRange(uncertainty ?? range[0], range)), arrived: 0, alone: [number],
      counts: byLevel.map((chunk) => chunk.count), orders, all: orders.length === directions.length,
      bytes: byLevel.map(({ count }) => chunkBytes(count)), rows: byLevel.map(({ count }) => Math.ceil(count / ROW)),
    };
  });
  const each = manifest.tiles.length / materials.length, largest = deviationOf(encoding, 255);
  const beyond = (RIM - 3) * largest; // the manifest's heights reach three deviations beyond the centres
  const classes = manifest.classes
    ? createClasses(manifest.classes, materials.length, side, heights) : null;
  const sphere = heights.kind === "sphere" ? heights : null;
  /** @type {TerrainTables} */
  const tables = {
    sphere, sphereCells: null, keeper: sphere ? createFraying(sphere, side, salt) : classes,
    nearest: directions.map((_, k) => nearestTwo(directions, k)),
    side, salt, directions, heights, tiles, variants: each / 16, each, levels: levels.length, largest, classes,
    objects: objects.map(({ ground }) => ({ ground, extent: 0 })), most: 1 + (scatter?.size ?? 0),
    scatter: scatter ? createScatter(scatter, objects, side, classes) : null,
    deviations: Float64Array.from({ length: 256 }, (_, byte) => deviationOf(encoding, byte)),
    switches: levels.map(({ distance }) => distance ?? Infinity), bands: levels.map(({ band }) => band ?? 0),
    z: [
      Math.min(...manifest.tiles.map((tile) => tile.z[0])) - beyond,
      Math.max(...manifest.tiles.map((tile) => tile.z[1])) + beyond,
    ],
    near: NEAR * manifest.eye_floor, cache: createCellCache(levels.length), cells: [], window: new Int32Array(RING * RING),
    room: viewRoom(manifest), wish: new Uint16Array(tiles.length),
  };
  if (sphere) tables.sphereCells = createSphereCells(tables, sphere);
  return tables;
}

/** The two directions that are nearest to one of them. @param {number[][]} directions @param {number} k */
const nearestTwo = (directions, k) => [...directions.keys()].filter((other) => other !== k)
  .sort((a, b) => dot(directions[k], directions[b]) - dot(directions[k], directions[a])).slice(0, 2);

/**
 * Paint points of the lattice of scores, and forget the cells about them.
 *
 * @param {TerrainTables} terrain
 * @param {Int32Array} points I, J and material (-1: as the rule) of each
 */
export function paintPoints({ classes, scatter, cache }, points) {
  if (!classes) return;
  /** @type {Map<string, [number, number]>} */
  const touched = new Map();
  for (let k = 0; k < points.length; k += 3) {
    const i = points[k], j = points[k + 1];
    classes.painted.set(i, j, points[k + 2]);
    for (const [a, b] of classes.painted.cellsAround(i, j)) touched.set(`${a},${b}`, [a, b]);
  }
  const margin = scatter?.margin ?? 0;
  for (const [i, j] of touched.values()) {
    classes.forget(i, j);
    scatter?.forget(i, j);
    for (let b = j - margin; b <= j + margin; b++) {
      for (let a = i - margin; a <= i + margin; a++) forgetCells(cache, a === i && b === j, [a, b]);
    }
  }
}

/**
 * Change what the noise of the rule adds to each material, and the probabilities of the objects.
 *
 * @param {TerrainTables} terrain
 * @param {{ offsets: number[] | null, probabilities: number[] | null }} changes null: as they are
 */
export function adjustCover({ classes, scatter, cache }, { offsets, probabilities }) {
  if (offsets) classes?.setOffsets(offsets);
  if (scatter && probabilities) scatter.setProbabilities(probabilities);
  else if (scatter && offsets) scatter.clear();
  forgetCells(cache, offsets !== null);
}
