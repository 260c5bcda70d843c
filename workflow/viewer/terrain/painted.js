// Painted places: points of the lattice of scores that a person gave a material. See classes.js for what they change.
// The same as dav_gswt/terrain/classes.py, where the idea is; tests/golden/classes.json holds both to it.

/**
 * Runs of painted points: [I, J, length, material], from (I, J) to the east, sorted by J, then by I.
 * @typedef {number[][]} Runs
 * @typedef {ReturnType<typeof createPainted>} Painted
 */

const BLOCK = 8; // points along the side of a block of storage
const FARTHEST = 2 ** 20; // blocks from the origin
export const MAX_PAINTED = 2 ** 18; // points
export const MAX_COORDINATE = BLOCK * FARTHEST; // of a point: painted ones are nearer to the origin
const SPREAD = [1, 4, 6, 4, 1]; // weights along an axis, by which a painted point counts for those around it
const WHOLE = 256; // sum of the products of two weights
const REACH = 2; // steps of the lattice to the farthest of them
const CORNERS = [[-REACH, -REACH], [REACH, -REACH], [-REACH, REACH], [REACH, REACH]];

/**
 * A sparse set of painted points.
 *
 * @param {number} lattice steps of the lattice of scores along a tile's side
 */
export function createPainted(lattice) {
  /** @type {Map<number, { i: number, j: number, values: Uint8Array, filled: number }>} */
  const blocks = new Map(); // values: 0: not painted; m + 1: material m
  let count = 0;
  /** @param {number} i @param {number} j of the block */
  const keyOf = (i, j) => (i + FARTHEST) * 2 * FARTHEST + (j + FARTHEST);
  /** @param {number} i @param {number} j of the block */
  const isNear = (i, j) => i >= -FARTHEST && i < FARTHEST && j >= -FARTHEST && j < FARTHEST;

  /** The block of a point. @param {number} i @param {number} j */
  function blockOf(i, j) {
    const a = Math.floor(i / BLOCK), b = Math.floor(j / BLOCK);
    return isNear(a, b) ? blocks.get(keyOf(a, b)) : undefined;
  }

  /** The material of a point, or -1. @param {number} i @param {number} j */
  function get(i, j) {
    const block = blockOf(i, j);
    return block ? block.values[(j - block.j * BLOCK) * BLOCK + i - block.i * BLOCK] - 1 : -1;
  }

  /**
   * Paint a point; material -1: back to the rule. A point beyond MAX_COORDINATE stays as it is.
   *
   * @param {number} i @param {number} j @param {number} material
   */
  function set(i, j, material) {
    const a = Math.floor(i / BLOCK), b = Math.floor(j / BLOCK), key = keyOf(a, b);
    if (!isNear(a, b)) return;
    let block = blocks.get(key);
    if (!block) {
      if (material < 0) return;
      block = { i: a, j: b, values: new Uint8Array(BLOCK * BLOCK), filled: 0 };
      blocks.set(key, block);
    }
    const at = (j - b * BLOCK) * BLOCK + i - a * BLOCK, more = Number(material >= 0) - Number(block.values[at] > 0);
    block.values[at] = material + 1;
    block.filled += more;
    count += more;
    if (!block.filled) blocks.delete(key);
  }

  /** All painted points. @returns {number[][]} [I, J, material], sorted by J, then by I */
  function points() {
    const found = [];
    for (const { i, j, values } of blocks.values()) {
      for (let k = 0; k < values.length; k++) {
        if (values[k]) found.push([i * BLOCK + (k % BLOCK), j * BLOCK + Math.floor(k / BLOCK), values[k] - 1]);
      }
    }
    return found.sort((p, q) => p[1] - q[1] || p[0] - q[0]);
  }

  return {
    get,
    set,
    points,
    /** Number of painted points. */
    get count() {
      return count;
    },
    /**
     * Weights of the materials painted at and around a point, in units of 1 / WHOLE. Returns: their sum.
     *
     * @param {number} i @param {number} j
     * @param {Float64Array} out by material; as it was where nothing is painted around
     */
    weightsAt(i, j, out) {
      let sum = 0;
      if (!count || !CORNERS.some(([x, y]) => blockOf(i + x, j + y))) return 0;
      out.fill(0);
      for (let y = -REACH; y <= REACH; y++) {
        for (let x = -REACH; x <= REACH; x++) {
          const material = get(i + x, j + y), weight = SPREAD[x + REACH] * SPREAD[y + REACH];
          if (material < 0) continue;
          out[material] += weight;
          sum += weight;
        }
      }
      return sum;
    },
    /** @returns {Runs} */
    runs() {
      /** @type {Runs} */
      const runs = [];
      for (const [i, j, material] of points()) {
        const last = runs[runs.length - 1];
        if (last && last[1] === j && last[3] === material && last[0] + last[2] === i) last[2] += 1;
        else runs.push([i, j, 1, material]);
      }
      return runs;
    },
    /** Cells whose scores a point changes, as [i, j]. @param {number} i @param {number} j */
    cellsAround(i, j) {
      const west = Math.ceil((i - REACH) / lattice) - 1, east = Math.floor((i + REACH) / lattice), cells = [];
      const south = Math.ceil((j - REACH) / lattice) - 1, north = Math.floor((j + REACH) / lattice);
      for (let b = south; b <= north; b++) for (let a = west; a <= east; a++) cells.push([a, b]);
      return cells;
    },
  };
}

/**
 * The key of what makes no sense in runs of painted points, or null.
 *
 * @param {any} runs
 * @param {number} materials number of them
 */
export function findRunFault(runs, materials) {
  let sum = 0;
  const sound = Array.isArray(runs) && runs.length <= MAX_PAINTED && runs.every((run) => {
    if (!Array.isArray(run) || run.length !== 4 || !run.every(Number.isInteger)) return false;
    const [i, j, length, m] = run;
    sum += length;
    return length > 0 && length <= MAX_PAINTED && m >= 0 && m < materials && Math.abs(j) < MAX_COORDINATE
      && Math.abs(i) < MAX_COORDINATE && i + length < MAX_COORDINATE;
  });
  return sound && sum <= MAX_PAINTED ? null : "runs";
}

/**
 * The scores at a point that has paint at or around it: those of the rule, less the highest and cut at -most, with the
 * weight that the paint leaves them, and 0 for what is painted and -most for all others with its weight. All materials
 * may be lifted by the same amount without effect, so unpainted points beside it need no such change.
 *
 * @param {Float64Array} scores the rule's, and then the new ones
 * @param {number} at index of the first material
 * @param {Float64Array} weights by material
 * @param {number} sum of the weights
 * @param {number} most
 */
export function applyPaint(scores, at, weights, sum, most) {
  let highest = -Infinity;
  for (let m = 0; m < weights.length; m++) highest = Math.max(highest, scores[at + m]);
  for (let m = 0; m < weights.length; m++) {
    const lead = Math.max(scores[at + m] - highest, -most);
    scores[at + m] = ((WHOLE - sum) * lead - most * (sum - weights[m])) / WHOLE;
  }
}
