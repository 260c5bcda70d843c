// What is painted and set on a terrain, and its history. Every change goes to the worker at once. What is painted is kept
// in the page's address, or as a file.

import { PageError } from "../data/checks.js";
import {
  blankPaint, changesTo, decodePaint, DENSITY_STEPS, describePaint, encodePaint, MAX_DENSITY, MAX_FILE, MAX_LINK,
  readPaint, scaleProbabilities, snap,
} from "../data/paint.js";
import { LATTICE } from "../terrain/classes.js";
import { createPainted, MAX_COORDINATE, MAX_PAINTED } from "../terrain/painted.js";
import { saveFile } from "./dom.js";

/**
 * @typedef {import("../data/paint.js").Paint} Paint
 * @typedef {ReturnType<typeof createPainting>} Painting
 */

const MAX_STEPS = 100, MAX_RUNS = 2 ** 18; // of the history

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {Pick<import("../scene/open_terrain.js").WorkerClient, "paint" | "adjust">} client
 * @param {() => void} onChange
 */
export function createPainting(manifest, client, onChange) {
  const painted = createPainted(LATTICE), step = manifest.tile_side / LATTICE, blank = blankPaint(manifest);
  let { densities, offsets } = blank;
  /** @type {Paint[]} */
  const done = []; // what was there before each step
  /** @type {Paint[]} */
  const undone = [];
  /** @type {Paint | null} */
  let before = null; // a stroke, or settings that are still being dragged
  for (const [i, j, length, m] of blank.runs) for (let k = 0; k < length; k++) painted.set(i + k, j, m);

  /** @returns {Paint} */
  const current = () => ({ runs: painted.runs(), densities, offsets });

  /** @param {number[][]} changes I, J, material */
  function apply(changes) {
    if (!changes.length) return;
    for (const [i, j, m] of changes) painted.set(i, j, m);
    client.paint(Int32Array.from(changes.flat()));
    onChange();
  }

  /** @param {Pick<Paint, "densities" | "offsets">} settings */
  function set(settings) {
    const dense = !equal(settings.densities, densities), moved = !equal(settings.offsets, offsets);
    ({ densities, offsets } = settings);
    if (!dense && !moved) return;
    client.adjust({
      offsets: moved ? offsets : null, probabilities: dense ? scaleProbabilities(manifest, densities) : null,
    });
    onChange();
  }

  /** @param {Paint} paint */
  function show(paint) {
    apply(changesTo(painted, paint.runs));
    set(paint);
  }

  /** What has changed becomes a step of the history. @param {Paint} old what was there before */
  function remember(old) {
    if (equal(old, current())) return;
    done.push(old);
    undone.length = 0;
    let sum = done.reduce((all, { runs }) => all + runs.length, 0);
    while (done.length > MAX_STEPS || (sum > MAX_RUNS && done.length > 1)) sum -= done.shift()?.runs.length ?? 0;
    onChange();
  }

  /** Undo or redo a step, but not during a stroke. @param {Paint[]} from @param {Paint[]} to */
  function travel(from, to) {
    const paint = before ? null : from.pop();
    if (!paint) return;
    to.push(current());
    show(paint);
    onChange();
  }

  /** The stroke, or the setting, is finished. */
  function end() {
    if (before) remember(before);
    before = null;
  }

  return {
    blank,
    painted,
    get paint() {
      return current();
    },
    get densities() {
      return densities;
    },
    get canUndo() {
      return done.length > 0;
    },
    get canRedo() {
      return undone.length > 0;
    },
    /** A stroke begins. */
    begin() {
      before = current();
    },
    /**
     * Paint the points within a radius of a place; material -1: back to the rule.
     *
     * @param {number} x @param {number} y @param {number} radius @param {number} material
     * @returns {"far" | "full" | null} why not all of them were painted
     */
    dab(x, y, radius, material) {
      if (Math.max(Math.abs(x), Math.abs(y)) + radius >= step * MAX_COORDINATE) return "far";
      const changes = [];
      let room = MAX_PAINTED - painted.count;
      for (let j = Math.ceil((y - radius) / step); j * step <= y + radius; j++) {
        for (let i = Math.ceil((x - radius) / step); i * step <= x + radius; i++) {
          const was = painted.get(i, j);
          if ((i * step - x) ** 2 + (j * step - y) ** 2 > radius ** 2 || was === material) continue;
          if (was < 0 && room-- <= 0) continue;
          changes.push([i, j, material]);
        }
      }
      apply(changes);
      return room < 0 ? "full" : null;
    },
    end,
    /** Take the stroke back. */
    cancel() {
      const old = before;
      before = null;
      if (old) show(old);
    },
    undo: () => travel(done, undone),
    redo: () => travel(undone, done),
    /**
     * Set how many times as densely an object stands. final: the slider was let go.
     *
     * @param {number} object @param {number} factor @param {boolean} final
     */
    setDensity(object, factor, final) {
      before ??= current();
      set({ densities: densities.with(object, snap(factor, DENSITY_STEPS, [0, MAX_DENSITY])), offsets });
      if (final) end();
    },
    /** Take a paint, as a step of the history or as its beginning. @param {Paint} paint @param {boolean} [undoable] */
    load(paint, undoable = true) {
      end();
      const old = current();
      show(paint);
      if (undoable) remember(old);
    },
  };
}

/** @template T @param {T} a @param {T} b */
const equal = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {ReturnType<typeof createPaintKeep>} PaintKeep
 */

const WAIT = 300; // milliseconds from the last change to the new link

/**
 * @param {Viewer} viewer
 * @param {(tooLong: boolean) => void} onLink called when the link has changed
 */
export function createPaintKeep(viewer, onLink) {
  let link = "", timer = 0, changes = 0;

  /** The link of what is painted now; "": as the bundle was made; null: too long. */
  async function findLink() {
    const { scene } = viewer;
    if (!scene) return "";
    const { painting, manifest } = scene, text = await encodePaint(painting.paint, manifest);
    if (text === await encodePaint(painting.blank, manifest)) return "";
    return text.length <= MAX_LINK ? text : null;
  }

  async function updateLink() {
    const change = ++changes, found = await findLink();
    if (change !== changes) return;
    link = found ?? "";
    onLink(found === null);
  }

  return {
    /** The part of the address; "": none. */
    get link() {
      return link;
    },
    findLink,
    /** Something was painted. */
    note() {
      clearTimeout(timer);
      timer = setTimeout(() => updateLink().catch((error) => viewer.fail(error)), WAIT);
    },
    /** A terrain was opened, whose link is not yet known. */
    reset() {
      clearTimeout(timer);
      changes += 1;
      link = "";
    },
    /**
     * Paint what a link holds; "": nothing. Throws a PageError.
     *
     * @param {string} text @param {boolean} [undoable]
     */
    async follow(text, undoable = true) {
      const { scene } = viewer;
      if (!scene || text === link) return;
      const paint = text ? await decodePaint(text, scene.manifest) : scene.painting.blank;
      if (viewer.scene !== scene) return;
      link = text;
      scene.painting.load(paint, undoable);
    },
    save() {
      const { scene } = viewer;
      if (!scene) return;
      const text = JSON.stringify(describePaint(scene.painting.paint, scene.manifest));
      saveFile(new Blob([text], { type: "application/json" }), "-painted.json");
    },
    /** Take a file's JSON. Throws a PageError. @param {unknown} value */
    load(value) {
      const { scene } = viewer;
      if (scene) scene.painting.load(readPaint(value, scene.manifest));
    },
  };
}

/** The JSON of a file that a person has chosen. Throws a PageError. @param {File} file @returns {Promise<unknown>} */
export async function readPaintFile(file) {
  if (file.size > MAX_FILE) throw new PageError(`${file.name} is too large for painted materials.`);
  try {
    return JSON.parse(await file.text());
  } catch {
    throw new PageError(`${file.name} is not readable as JSON. Open a file that “Save” has saved here.`);
  }
}
