// Placement of objects: which are drawn with which cell, at which levels and in which order.
// Port of dav_gswt/terrain/object_placement.py.

import { addMissing, pickLevels } from "./budget.js";
import { RING } from "./caches.js";
import { nearestOrder } from "./draw_order.js";
import { createBallTest, frustumPlanes } from "./frustum.js";

/**
 * @typedef {import("./scatter.js").Thing} Thing
 * @typedef {import("../worker/terrain_tables.js").TerrainTables} TerrainTables
 */

/**
 * The objects in view of cells, by the index of the cell that each is drawn with, by falling distance; null: none.
 *
 * An object reaches over the edges of its own cell. Of the cells that its footprint touches, the one nearest to the eye
 * is drawn last, and the object right after it: else the ground of a nearer cell would cover what hangs over it. Where
 * that cell is not visible, the object is drawn with its own.
 *
 * @param {TerrainTables} terrain @param {import("./camera.js").Camera} camera
 * @param {import("./budget.js").Selection} selection
 */
export function placeObjects(terrain, camera, { cells, switches, bands, missing }) {
  /** @type {(Thing[] | null)[]} */
  const groups = new Array(cells.length).fill(null);
  if (!terrain.scatter) return groups;
  const isOutside = createBallTest(frustumPlanes(camera, terrain.near)), drawnWith = terrain.window.fill(-1);
  const { eye } = camera;
  const i0 = Math.floor(eye[0] / terrain.side), j0 = Math.floor(eye[1] / terrain.side);
  for (let k = 0; k < cells.length; k++) drawnWith[windowIndex(cells[k].di, cells[k].dj)] = k;
  for (let k = 0; k < cells.length; k++) {
    for (const thing of cells[k].things) {
      const { arrived } = terrain.tiles[thing.tile];
      aimThing(thing, terrain, eye, i0, j0);
      if (isOutside(thing.to, thing.farthest - thing.distance)) continue;
      const drawn = pickLevels(terrain, thing, arrived, switches, bands);
      if (thing.missing && !terrain.room) addMissing(missing, thing.tile, thing.missing);
      if (!drawn) continue;
      orderThing(thing, terrain);
      const east = nearestTouched(thing.i - i0, thing.u, thing.radius);
      const north = nearestTouched(thing.j - j0, thing.v, thing.radius);
      const found = drawnWith[windowIndex(east, north)], owner = found < 0 ? k : found, group = groups[owner];
      if (group) insertByDistance(group, thing);
      else groups[owner] = [thing];
    }
  }
  return groups;
}

/** Add an object to a list by falling distance, after those at its own. @param {Thing[]} group @param {Thing} thing */
function insertByDistance(group, thing) {
  let at = group.push(thing) - 1;
  for (; at > 0 && group[at - 1].distance < thing.distance; at--) group[at] = group[at - 1];
  group[at] = thing;
}

/** @param {number} di @param {number} dj */
const windowIndex = (di, dj) => (dj & (RING - 1)) * RING + (di & (RING - 1));

/**
 * Of the cells along an axis that a footprint touches, counted from the eye's, the one nearest to the eye.
 *
 * @param {number} cell
 * @param {number} place in it
 * @param {number} radius
 */
const nearestTouched = (cell, place, radius) => (
  Math.min(Math.max(0, cell + Math.floor(place - radius)), cell + Math.floor(place + radius)));

/**
 * Foot and distances of an object, seen from the eye.
 *
 * @param {Thing} thing @param {TerrainTables} terrain @param {number[]} eye @param {number} i0
 * @param {number} j0
 */
function aimThing(thing, { side, heights, objects }, eye, i0, j0) {
  const { i, j, u, v, number, size, to } = thing;
  if (Number.isNaN(thing.h)) [thing.h, thing.east, thing.north] = heights.at((i + u) * side, (j + v) * side);
  thing.x = i - i0 + u;
  thing.y = j - j0 + v;
  to[0] = thing.x * side + (i0 * side - eye[0]);
  to[1] = thing.y * side + (j0 * side - eye[1]);
  to[2] = objects[number].ground + thing.h - eye[2];
  const reach = objects[number].extent * size * (1 + heights.steepest);
  thing.distance = Math.sqrt(to[0] * to[0] + to[1] * to[1] + to[2] * to[2]);
  thing.nearest = thing.distance - reach;
  thing.farthest = thing.distance + reach;
}

/**
 * The order nearest to the viewing direction, turned back as the object is turned.
 *
 * @param {Thing} thing @param {TerrainTables} terrain
 */
function orderThing(thing, { tiles, directions }) {
  const { cos, sin, to: [x, y, z], east, north, tile } = thing, { orders } = tiles[tile];
  const back = [cos * x + sin * y, cos * y - sin * x, z];
  thing.order = nearestOrder(directions, orders, back, cos * east + sin * north, cos * north - sin * east);
  thing.direction = orders[thing.order];
}
