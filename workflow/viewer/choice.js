// Which tile lies in which cell: an integer hash of its edges, so that a place is the same on every visit.
// The same integers as dav_gswt/terrain/choice.py; tests/golden/tile_choice.json holds both to it.

export const WEST = 0, SOUTH = 1, CENTRE = 2; // what a hash is for: west edge, south edge, centre variant

/** 32 well mixed bits for cell (i, j). All arithmetic is modulo 2^32, negative coordinates in two's complement. */
export function hashed(i, j, axis, salt) {
  let h = Math.imul(i, 0x8da6b343) ^ Math.imul(j, 0xd8163841) ^ Math.imul(axis, 0xcb1ab31f) ^ salt;
  h = Math.imul(h ^ (h >>> 16), 0x85ebca6b);
  h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
  return (h ^ (h >>> 16)) >>> 0;
}

/**
 * Number of the tile in cell (i, j): T = 16 c + 8 W + 4 N + 2 E + S, with `variants` centres. The centre is the hash's, but where
 * i + j is odd the next one that makes the tile equal to none of its neighbours, which are even: no tile lies beside itself.
 */
export function tileAt(i, j, salt, variants) {
  const edges = edgesOf(i, j, salt), centre = centreOf(i, j, salt, variants);
  if (variants === 1 || (i + j) % 2 === 0) return 16 * centre + edges;
  let taken = 0; // a bit for each centre that a neighbour with the same edges has
  const across = edges >> 3 === (edges >> 1 & 1), along = (edges >> 2 & 1) === (edges & 1);
  for (const step of [-1, 1]) { // only a tile with equal sides can lie beside itself
    if (across && edgesOf(i + step, j, salt) === edges) taken |= 1 << centreOf(i + step, j, salt, variants);
    if (along && edgesOf(i, j + step, salt) === edges) taken |= 1 << centreOf(i, j + step, salt, variants);
  }
  for (let step = 0; step < variants; step++) {
    const other = (centre + step) % variants;
    if (!(taken >> other & 1)) return 16 * other + edges;
  }
  return 16 * centre + edges;
}

function edgesOf(i, j, salt) {
  const west = hashed(i, j, WEST, salt) & 1, east = hashed(i + 1, j, WEST, salt) & 1;
  const south = hashed(i, j, SOUTH, salt) & 1, north = hashed(i, j + 1, SOUTH, salt) & 1;
  return 8 * west + 4 * north + 2 * east + south;
}

function centreOf(i, j, salt, variants) {
  return (hashed(i, j, CENTRE, salt) >>> 1) % variants;
}
