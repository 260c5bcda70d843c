// The endless terrain: which tiles are in sight, at which level and in which order they are drawn.
// Offsets are taken from the eye in double precision before the GPU sees them: kilometres out nothing shakes.

import { tileAt } from "./choice.js";

const THINNEST = 0.25; // tiles are drawn until a row of them is this many pixels tall
const NEAREST_END = 4, FARTHEST_END = 32; // and that is between so many tile sides
const NEAR = 0.1; // splats nearer than this share of the eye floor are left out
const FADE = 0.75; // share of the reach from which the last tiles give way to the far ground
const COARSEST = 1 / 64; // by how much level distances may shrink to keep within the budget
const HALVINGS = 10; // steps of the search for that factor

/** What is needed of a manifest to choose tiles: sizes and counts in flat tables. */
export function createTerrain(manifest) {
  const { tile_side: side, salt, levels, directions } = manifest;
  const variants = manifest.tiles.length / 16;
  const tiles = manifest.tiles.map(({ z, chunks }) => {
    const byLevel = [...chunks].sort((a, b) => a.level - b.level);
    return { z, counts: byLevel.map((chunk) => chunk.count), orders: byLevel.map((chunk) => chunk.orders) };
  });
  const distances = levels.slice(0, -1).map((level) => level.distance);
  const z = [Math.min(...tiles.map((tile) => tile.z[0])), Math.max(...tiles.map((tile) => tile.z[1]))];
  const margin = 2 * levels[levels.length - 1].mean_scale || 0; // how far a splat may reach over its tile's edge
  const near = NEAR * manifest.eye_floor;
  return { side, salt, variants, tiles, distances, directions, z, margin, near, arrived: tiles.map(() => new Set()) };
}

/** The number of the tile under a point of the ground. */
export function tileUnder(terrain, x, y) {
  const i = Math.floor(x / terrain.side), j = Math.floor(y / terrain.side);
  return { i, j, tile: tileAt(i, j, terrain.salt, terrain.variants) };
}

/**
 * What to draw: tiles back to front with level, order and offset, the reach of the tiles and where they fade.
 *
 * At most `budget` Gaussians: levels and the far ground come nearer together (coarser tiles sooner, fewer tiles), and
 * where that is not enough the farthest tiles go.
 */
export function visible(terrain, camera, budget) {
  const farthest = reachOf(terrain, camera);
  let cells = inSight(terrain, camera, farthest), count = 0, kept = 0;
  const shrink = shrinkFor(terrain, cells, farthest, budget);
  let reach = farthest * Math.sqrt(shrink);
  cells = cells.filter((cell) => cell.distance < reach).sort((a, b) => a.distance - b.distance);
  for (const cell of cells) {
    cell.level = levelOf(terrain, cell, shrink);
    if (cell.level < 0) { // nothing of this tile has arrived yet
      kept += 1;
      continue;
    }
    const more = terrain.tiles[cell.tile].counts[cell.level];
    if (count + more > budget && count) {
      reach = Math.min(reach, Math.max(cell.distance, terrain.near));
      break;
    }
    count += more;
    kept += 1;
  }
  const tiles = cells.slice(0, kept).filter((cell) => cell.level >= 0);
  for (const cell of tiles) cell.order = orderOf(terrain, cell);
  // Cells of a grid hide each other only along paths that lead away from the eye's own cell in i and in j, so this
  // order is exact; ties hide nothing of each other.
  tiles.sort((a, b) => b.steps - a.steps || a.j - b.j || a.i - b.i);
  return { tiles, count, reach, fade: [FADE * reach, reach], near: terrain.near };
}

/** How far tiles are drawn: at distance d a row of them is focal * height * side / d^2 pixels tall. */
function reachOf({ side }, { focal, eye }) {
  const thin = Math.sqrt((focal * eye[2] * side) / THINNEST);
  return Math.min(Math.max(thin, NEAREST_END * side), FARTHEST_END * side);
}

/** Cells within reach that the picture may show. */
function inSight(terrain, camera, reach) {
  const { side, z, margin } = terrain, [x, y, height] = camera.eye;
  const i0 = Math.floor(x / side), j0 = Math.floor(y / side), most = Math.ceil(reach / side);
  const planes = planesOf(camera, terrain.near);
  const half = [side / 2 + margin, side / 2 + margin, (z[1] - z[0]) / 2 + margin];
  const middle = (z[0] + z[1]) / 2 - height;
  const found = [];
  for (let j = j0 - most; j <= j0 + most; j++) {
    const south = j * side - y, away = Math.max(south, -south - side, 0);
    for (let i = i0 - most; i <= i0 + most; i++) {
      const west = i * side - x;
      const distance = Math.hypot(Math.max(west, -west - side, 0), away, height);
      if (distance >= reach || outside(planes, [west + side / 2, south + side / 2, middle], half)) continue;
      const tile = tileAt(i, j, terrain.salt, terrain.variants);
      const steps = Math.abs(i - i0) + Math.abs(j - j0);
      found.push({ i, j, tile, distance, steps, offset: [west, south, -height], level: -1, order: 0 });
    }
  }
  return found;
}

/** The frustum's five planes through or before the eye: normal (inwards) and distance. */
function planesOf({ right, up, ahead, width, height, focal }, near) {
  const side = (axis, size, sign) => [...ahead.map((a, k) => (a * size) / 2 + sign * focal * axis[k]), 0];
  return [[...ahead, -near], side(right, width, 1), side(right, width, -1), side(up, height, 1), side(up, height, -1)];
}

/** Is the box wholly on the outer side of one plane? */
function outside(planes, centre, half) {
  for (const [a, b, c, d] of planes) {
    const most = a * centre[0] + b * centre[1] + c * centre[2] + d
      + Math.abs(a) * half[0] + Math.abs(b) * half[1] + Math.abs(c) * half[2];
    if (most < 0) return true;
  }
  return false;
}

/**
 * The largest factor s (at most 1) that keeps within the budget: on the level distances, and its root on the reach.
 * Coarse far tiles are so many that finer near ones would go first, were the levels alone to give.
 */
function shrinkFor(terrain, cells, farthest, budget) {
  const cost = (shrink) => {
    let sum = 0;
    for (const cell of cells) {
      if (cell.distance >= farthest * Math.sqrt(shrink)) continue;
      const level = levelOf(terrain, cell, shrink);
      if (level >= 0) sum += terrain.tiles[cell.tile].counts[level];
    }
    return sum;
  };
  if (cost(1) <= budget) return 1;
  let low = Math.log(COARSEST), high = 0;
  for (let k = 0; k < HALVINGS; k++) {
    const middle = (low + high) / 2;
    if (cost(Math.exp(middle)) <= budget) low = middle;
    else high = middle;
  }
  return Math.exp(low);
}

/** The level that the distance asks for, or the next one that has arrived (coarser ones come first); -1: none has. */
function levelOf({ distances, arrived, tiles }, { tile, distance }, shrink) {
  let wanted = 0;
  while (wanted < distances.length && distance >= shrink * distances[wanted]) wanted += 1;
  const there = arrived[tile];
  for (let level = wanted; level < tiles[tile].counts.length; level++) if (there.has(level)) return level;
  for (let level = wanted - 1; level >= 0; level--) if (there.has(level)) return level;
  return -1;
}

/** The pre-sorted order whose direction is nearest to that from the eye to the tile's centre. */
function orderOf({ side, tiles, directions }, { tile, level, offset }) {
  const { z, orders } = tiles[tile];
  const to = [offset[0] + side / 2, offset[1] + side / 2, offset[2] + (z[0] + z[1]) / 2];
  let best = 0, most = -Infinity;
  orders[level].forEach((direction, k) => {
    const [x, y, up] = directions[direction];
    const along = x * to[0] + y * to[1] + up * to[2];
    if (along > most) [best, most] = [k, along];
  });
  return best;
}
