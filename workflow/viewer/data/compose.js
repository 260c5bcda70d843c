// The parts of a bundle as they are kept, and the chunks that are composed of them: docs/formats.md to the byte, as
// dav_gswt/bundle/recipes.py does it. All work goes in steps of about STEP Gaussians, so that nobody waits for it long.

import { PageError, REMAKE } from "./checks.js";
import { RECORD } from "./layout.js";

/**
 * @typedef {import("./manifest.js").Manifest} Manifest
 *
 * Gaussians of an exemplar at a level, cell by cell: five words each, and where each cell begins.
 * @typedef {{ starts: Uint32Array, words: Uint32Array }} Layer
 *
 * What a tile shows: shifts of its labels in finest cells (x, y); by level the label of each cell, and what is added
 * there to z, green, red and blue, one after the other.
 * @typedef {{ shifts: Int16Array, maps: { labels: Uint8Array, corrections: Int16Array }[] }} Recipe
 * @typedef {ReturnType<typeof createComposer>} Composer
 */

export const STEP = 8192; // Gaussians
export const PLANES = 19; // bytes of a Gaussian in a block
const WIDE = 5; // words of a Gaussian of an exemplar, whose colours have 16 bits
const LABELS = 9, LAYERS = 3; // ground, its underlay, what else there is

/** @param {number} v @param {number} most */
const clamp = (v, most) => Math.min(Math.max(v, 0), most);
/** A difference of two values, kept as 0, -1, 1, -2, ... @param {number} low @param {number} high */
const difference = (low, high) => ((low | (high << 8)) >>> 1) ^ -(low & 1);
/** @param {string} file @param {string} what */
const broken = (file, what) => new PageError(`${file} makes no sense: ${what}. ${REMAKE}`);

/**
 * Records as words, and of each Gaussian its centre and the byte of its largest deviation.
 *
 * @param {Uint32Array} records @param {import("./layout.js").Encoding} encoding
 */
export function* parseRecords(records, { origin, step }) {
  const count = records.length / 4, centres = new Float32Array(3 * count), sizes = new Uint8Array(count);
  for (let k = 0; k < count;) {
    for (const end = Math.min(count, k + STEP); k < end; k++) {
      const first = records[4 * k], second = records[4 * k + 1];
      centres[3 * k] = origin[0] + step[0] * (first & 65535);
      centres[3 * k + 1] = origin[1] + step[1] * (first >>> 16);
      centres[3 * k + 2] = origin[2] + step[2] * (second & 65535);
      sizes[k] = Math.max((second >>> 16) & 255, second >>> 24, records[4 * k + 2] & 255);
    }
    yield;
  }
  return { records, centres, sizes };
}

/**
 * The Gaussians of a block: records, or `wide` ones with colours as they are.
 *
 * @param {Uint8Array} bytes @param {number} at @param {number} count @param {boolean} wide
 */
function* unpackBlock(bytes, at, count, wide) {
  const size = wide ? WIDE : RECORD / 4, words = new Uint32Array(size * count);
  const [xl, xh, yl, yh, zl, zh, s0, s1, s2, r0, r1, r2, gl, gh, rl, rh, bl, bh, opacity] = Array.from(
    { length: PLANES }, (_, plane) => bytes.subarray(at + plane * count, at + (plane + 1) * count));
  for (let k = 0, w = 0, z = 0; k < count;) {
    for (const end = Math.min(count, k + STEP); k < end; k++, w += size) {
      z = (z + difference(zl[k], zh[k])) & 65535;
      const green = gl[k] | (gh[k] << 8);
      const red = green + difference(rl[k], rh[k]), blue = green + difference(bl[k], bh[k]);
      words[w] = xl[k] | (xh[k] << 8) | (yl[k] << 16) | (yh[k] << 24);
      words[w + 1] = z | (s0[k] << 16) | (s1[k] << 24);
      words[w + 2] = s2[k] | (r0[k] << 8) | (r1[k] << 16) | (r2[k] << 24);
      if (wide) {
        words[w + 3] = (red & 65535) | (green << 16);
        words[w + 4] = (blue & 65535) | (opacity[k] << 16);
      } else words[w + 3] = paintOf((red << 16) >> 16, (green << 16) >> 16, (blue << 16) >> 16, opacity[k]);
    }
    yield;
  }
  return words;
}

/** @param {number} red @param {number} green @param {number} blue @param {number} opacity */
const paintOf = (red, green, blue, opacity) =>
  clamp(red, 255) | (clamp(green, 255) << 8) | (clamp(blue, 255) << 16) | (opacity << 24);

/**
 * What a tile shows at a level: of each cell the label that most of its finest cells have (of equally many the first),
 * and the mean of what is added to these.
 *
 * @param {Recipe["maps"][0]} finest @param {number} side finest cells @param {number} level
 */
function coarsen({ labels, corrections }, side, level) {
  const along = side >> level, cells = along ** 2, wide = 1 << level;
  const counts = new Int32Array(LABELS), sums = [0, 0, 0, 0];
  const made = { labels: new Uint8Array(cells), corrections: new Int16Array(4 * cells) };
  for (let k = 0; k < cells; k++) {
    const first = Math.floor(k / along) * wide * side + (k % along) * wide;
    counts.fill(0);
    for (let n = 0; n < wide * wide; n++) counts[labels[first + (n >> level) * side + (n & (wide - 1))]] += 1;
    let label = 0;
    for (let n = 1; n < LABELS; n++) if (counts[n] > counts[label]) label = n;
    const many = counts[label];
    sums.fill(0);
    for (let n = 0; n < wide * wide; n++) {
      const at = first + (n >> level) * side + (n & (wide - 1));
      if (labels[at] === label) for (let c = 0; c < 4; c++) sums[c] += corrections[c * labels.length + at];
    }
    made.labels[k] = label;
    for (let c = 0; c < 4; c++) made.corrections[c * cells + k] = Math.floor((2 * sums[c] + many) / (2 * many));
  }
  return made;
}

/** Chunks by tile, or object, and level. @param {Manifest} manifest */
export function createComposer(manifest) {
  const { parts, tiles, composition, encoding: { origin, step } } = manifest;
  const each = tiles.length / manifest.materials.length;
  const owners = [...tiles, ...manifest.objects ?? []].map(({ chunks }) => (
    [...chunks].sort((a, b) => a.level - b.level)));
  const [west, south] = [0, 1].map((axis) => Math.round(-origin[axis] / step[axis]));
  const { side = 0, cell = 0, levels = 0, exemplars = [] } = composition ?? {};
  /** @type {(Uint32Array | undefined)[]} */
  const records = []; // by part
  /** @type {Layer[][][]} */
  const layers = []; // by level and material
  /** @type {Recipe[] | null} */
  let recipes = null; // by tile
  /** @type {boolean[]} */
  const sound = []; // by level

  /** @param {Uint8Array} bytes @param {number} level @param {string} file */
  function* unpackLevel(bytes, level, file) {
    const most = cell << level, made = [];
    let at = 0;
    for (const finest of exemplars) {
      const cells = (finest >> level) ** 2, pair = [];
      for (let layer = 0; layer < LAYERS; layer++) {
        if (at + 2 * cells > bytes.length) throw broken(file, "it is cut short");
        const starts = new Uint32Array(cells + 1);
        let sum = 0; // beyond 32 bits in a hostile part
        for (let k = 0; k < cells; k++) starts[k + 1] = sum += bytes[at + k] | (bytes[at + cells + k] << 8);
        at += 2 * cells;
        if (at + PLANES * sum > bytes.length) throw broken(file, "it is cut short");
        const words = yield* unpackBlock(bytes, at, starts[cells], true);
        at += PLANES * starts[cells];
        for (let w = 0; w < words.length;) {
          for (const end = Math.min(words.length, w + WIDE * STEP); w < end; w += WIDE) {
            if ((words[w] & 65535) <= most && words[w] >>> 16 <= most) continue;
            throw broken(file, "a splat lies outside of its cell");
          }
          yield;
        }
        pair.push({ starts, words });
      }
      made.push(pair);
    }
    if (at !== bytes.length) throw broken(file, "it is too long");
    return made;
  }

  /** @param {Uint8Array} bytes @param {string} file */
  function* unpackRecipes(bytes, file) {
    const cells = side ** 2, made = [];
    if (bytes.length !== LABELS * (4 + cells) * tiles.length) throw broken(file, "it holds other than a recipe a tile");
    for (let at = 0; at < bytes.length;) {
      const shifts = new Int16Array(bytes.slice(at, at + 4 * LABELS).buffer);
      at += 4 * LABELS;
      const labels = bytes.slice(at, at + cells), corrections = new Int16Array(4 * cells);
      const maps = [{ labels, corrections }];
      if (labels.some((label) => label >= LABELS)) throw broken(file, "a label is out of range");
      at += cells;
      for (let c = 0; c < 4; c++, at += 2 * cells) {
        for (let k = 0, sum = 0; k < cells; k++) {
          sum += difference(bytes[at + k], bytes[at + cells + k]);
          corrections[c * cells + k] = sum;
        }
      }
      for (let level = 1; level < levels; level++) {
        yield;
        maps.push(coarsen(maps[0], side, level));
      }
      made.push({ shifts, maps });
      yield;
    }
    return made;
  }

  /** The cells of the exemplar that a tile shows at a level; -1: outside. @param {number} tile @param {number} level */
  function sourcesOf(tile, level) {
    const { shifts, maps: { [level]: { labels } } } = /** @type {Recipe[]} */ (recipes)[tile];
    const cells = exemplars[Math.floor(tile / each)] >> level, along = side >> level;
    const found = new Int32Array(labels.length);
    for (let k = 0; k < labels.length; k++) {
      const x = shifts[2 * labels[k]], y = shifts[2 * labels[k] + 1];
      const column = (k % along) + (x >> level), row = Math.floor(k / along) + (y >> level);
      const inside = column >= 0 && row >= 0 && column < cells && row < cells && !((x | y) & ((1 << level) - 1));
      found[k] = inside ? row * cells + column : -1;
    }
    return found;
  }

  /** Compare recipes with a level, as soon as both are there. @param {number} level */
  function* check(level) {
    if (!recipes || !layers[level]) return;
    const { file } = /** @type {import("./manifest.js").PartEntry} */ (parts.find(({ kind }) => kind === "recipes"));
    for (let tile = 0; tile < recipes.length; tile++) {
      const material = Math.floor(tile / each), sources = sourcesOf(tile, level);
      if (sources.includes(-1)) throw broken(file, `tile ${tile} shows what is not in the exemplar`);
      let count = 0;
      for (const { starts } of layers[level][material]) {
        for (const cell of sources) count += starts[cell + 1] - starts[cell];
      }
      if (count !== owners[tile][level].count) {
        throw broken(file, `tile ${tile} has ${count} splats at level ${level}, not ${owners[tile][level].count}`);
      }
      yield;
    }
    sound[level] = true;
  }

  return {
    /**
     * Take a part. Throws a PageError: it contradicts itself or the others.
     *
     * @param {number} index @param {ArrayBuffer} buffer unpacked
     */
    *add(index, buffer) {
      const { kind, file, level = 0 } = parts[index], bytes = new Uint8Array(buffer);
      if (kind === "plain") records[index] = new Uint32Array(buffer);
      else if (kind === "records") records[index] = yield* unpackBlock(bytes, 0, bytes.length / PLANES, false);
      else if (kind === "level") {
        layers[level] = yield* unpackLevel(bytes, level, file);
        yield* check(level);
      } else {
        recipes = yield* unpackRecipes(bytes, file);
        for (let l = 0; l < levels; l++) yield* check(l);
      }
    },
    /** Are the parts of a chunk there? @param {number} tile @param {number} level */
    has(tile, level) {
      const { part } = owners[tile][level];
      return part === undefined ? sound[level] ?? false : records[part] !== undefined;
    },
    /**
     * The records of a chunk whose parts are there.
     *
     * @param {number} tile @param {number} level
     * @returns {Generator<void, Uint32Array>}
     */
    *compose(tile, level) {
      const { part, first = 0, count } = owners[tile][level];
      const stored = part === undefined ? undefined : records[part];
      if (stored) return stored.subarray(4 * first, 4 * (first + count));
      const { corrections } = /** @type {Recipe[]} */ (recipes)[tile].maps[level];
      const along = side >> level, pace = cell << level;
      const out = new Uint32Array(4 * count), sources = sourcesOf(tile, level), many = sources.length;
      let n = 0, due = 4 * STEP;
      for (const { starts, words } of layers[level][Math.floor(tile / each)]) {
        for (let k = 0; k < many; k++) {
          const x = west + (k % along) * pace, y = south + Math.floor(k / along) * pace;
          const dz = corrections[k], dg = corrections[many + k], dr = corrections[2 * many + k];
          const db = corrections[3 * many + k], end = WIDE * starts[sources[k] + 1];
          for (let w = WIDE * starts[sources[k]]; w < end; w += WIDE, n += 4) {
            const place = words[w], second = words[w + 1], third = words[w + 3], last = words[w + 4];
            out[n] = ((place & 65535) + x) | (((place >>> 16) + y) << 16);
            out[n + 1] = (second & 0xffff0000) | clamp((second & 65535) + dz, 65535);
            out[n + 2] = words[w + 2];
            const red = ((third << 16) >> 16) + dr, blue = ((last << 16) >> 16) + db;
            out[n + 3] = paintOf(red, (third >> 16) + dg, blue, last >>> 16);
          }
          if (n >= due) {
            due = n + 4 * STEP;
            yield;
          }
        }
      }
      return out;
    },
  };
}
