// Tile choice: the Wang tile of every cell, by an integer hash of its edges.
// The same integers as dav_gswt/terrain/choice.py; tests/golden/tile_choice.json holds both to it.

const WEST = 0, SOUTH = 1, CENTRE = 2; // axis of a hash: west edge, south edge, centre variant

/**
 * 32 well mixed bits for cell (i, j). All arithmetic is modulo 2^32, negative coordinates in two's complement.
 *
 * @param {number} i @param {number} j @param {number} axis @param {number} salt
 */
export function hashCell(i, j, axis, salt) {
  const h = mix(Math.imul(i, 0x8da6b343) ^ Math.imul(axis, 0xcb1ab31f) ^ salt);
  return mix((h + Math.imul(j, 0xd8163841)) | 0) >>> 0;
}

/** The finaliser of MurmurHash3. @param {number} h */
function mix(h) {
  h = Math.imul(h ^ (h >>> 16), 0x85ebca6b);
  h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
  return h ^ (h >>> 16);
}

/**
 * Number of the tile in cell (i, j): T = 16 c + 8 W + 4 N + 2 E + S.
 *
 * The centre c is that of the hash. Where i + j is odd it is the next one that makes the tile differ from all of its
 * neighbours, which are even, so equal tiles are never adjacent.
 *
 * @param {number} i @param {number} j @param {number} salt
 * @param {number} variants number of centres
 * @param {number} [period] (i + period, j + period) is the same cell as (i, j); 0: none
 */
export function tileAt(i, j, salt, variants, period = 0) {
  const edges = edgesOf(i, j, salt, period), centre = centreOf(i, j, salt, variants, period);
  if (variants === 1 || (i + j) % 2 === 0) return 16 * centre + edges;
  let taken = 0; // one bit for each centre of a neighbour with the same edges
  const across = edges >> 3 === ((edges >> 1) & 1), along = ((edges >> 2) & 1) === (edges & 1);
  for (const step of [-1, 1]) { // only a tile with equal opposite edges can be its own neighbour
    if (across && edgesOf(i + step, j, salt, period) === edges) taken |= 1 << centreOf(i + step, j, salt, variants, period);
    if (along && edgesOf(i, j + step, salt, period) === edges) taken |= 1 << centreOf(i, j + step, salt, variants, period);
  }
  for (let step = 0; step < variants; step++) {
    const other = (centre + step) % variants;
    if (!((taken >> other) & 1)) return 16 * other + edges;
  }
  return 16 * centre + edges;
}

/** @param {number} i @param {number} j @param {number} salt @param {number} period */
function edgesOf(i, j, salt, period) {
  const west = hashFirst(i, j, WEST, salt, period) & 1, east = hashFirst(i + 1, j, WEST, salt, period) & 1;
  const south = hashFirst(i, j, SOUTH, salt, period) & 1, north = hashFirst(i, j + 1, SOUTH, salt, period) & 1;
  return 8 * west + 4 * north + 2 * east + south;
}

/** @param {number} i @param {number} j @param {number} salt @param {number} variants @param {number} period */
function centreOf(i, j, salt, variants, period) {
  return (hashFirst(i, j, CENTRE, salt, period) >>> 1) % variants;
}

/**
 * The hash of the cell with 0 <= j < period that is the same as (i, j).
 *
 * @param {number} i @param {number} j @param {number} axis @param {number} salt
 * @param {number} period
 */
function hashFirst(i, j, axis, salt, period) {
  const back = period ? Math.floor(j / period) * period : 0;
  return hashCell(i - back, j - back, axis, salt);
}
