// What is painted and set on a terrain, and its history. Every change goes to the worker at once.

import {
  blankPaint, changesTo, DENSITY_STEPS, MAX_DENSITY, MAX_OFFSET, OFFSET_STEPS, scaleProbabilities, snap,
} from "../data/paint.js";
import { LATTICE } from "../terrain/classes.js";
import { createPainted, MAX_COORDINATE, MAX_PAINTED } from "../terrain/painted.js";

/**
 * @typedef {import("../data/paint.js").Paint} Paint
 * @typedef {Pick<Paint, "densities" | "offsets">} Settings
 *
 * A step of the history. points: I, J, material before, material after.
 * @typedef {{ points: number[][], before: Settings, after: Settings }} Step
 * @typedef {ReturnType<typeof createPainting>} Painting
 */

const MAX_STEPS = 100, MAX_POINTS = 2 ** 20; // of the history

/**
 * @param {import("../data/manifest.js").Manifest} manifest
 * @param {Pick<import("../worker/worker_client.js").WorkerClient, "paint" | "adjust">} client
 * @param {() => void} onChange
 */
export function createPainting(manifest, client, onChange) {
  const painted = createPainted(LATTICE), step = manifest.tile_side / LATTICE, blank = blankPaint(manifest);
  let { densities, offsets } = blank;
  /** @type {Step[]} */
  const done = [];
  /** @type {Step[]} */
  const undone = [];
  /** @type {Map<string, number[]> | null} */
  let stroke = null; // points since it began, and what they were
  /** @type {Settings | null} */
  let before = null; // of settings that are still being dragged
  for (const [i, j, length, m] of blank.runs) for (let k = 0; k < length; k++) painted.set(i + k, j, m);

  /** @param {number[][]} changes I, J, material */
  function apply(changes) {
    if (!changes.length) return;
    for (const [i, j, m] of changes) painted.set(i, j, m);
    client.paint(Int32Array.from(changes.flat()));
    onChange();
  }

  /** @param {Settings} settings */
  function set(settings) {
    const dense = !equal(settings.densities, densities), moved = !equal(settings.offsets, offsets);
    ({ densities, offsets } = settings);
    if (!dense && !moved) return;
    client.adjust({
      offsets: moved ? offsets : null, probabilities: dense ? scaleProbabilities(manifest, densities) : null,
    });
    onChange();
  }

  /** @param {Step} one */
  function remember(one) {
    if (!one.points.length && equal(one.before.densities, one.after.densities)
      && equal(one.before.offsets, one.after.offsets)) return;
    done.push(one);
    undone.length = 0;
    let sum = done.reduce((all, { points }) => all + points.length, 0);
    while (done.length > MAX_STEPS || (sum > MAX_POINTS && done.length > 1)) sum -= done.shift()?.points.length ?? 0;
    onChange();
  }

  const settings = () => ({ densities, offsets });

  return {
    blank,
    painted,
    /** @returns {Paint} */
    get paint() {
      return { runs: painted.runs(), densities, offsets };
    },
    get densities() {
      return densities;
    },
    get offsets() {
      return offsets;
    },
    get canUndo() {
      return done.length > 0;
    },
    get canRedo() {
      return undone.length > 0;
    },
    begin() {
      stroke = new Map();
    },
    /**
     * Paint the points within a radius of a place; material -1: back to the rule.
     *
     * @param {number} x
     * @param {number} y
     * @param {number} radius
     * @param {number} material
     * @returns {"far" | "full" | null} why not all of them were painted
     */
    dab(x, y, radius, material) {
      if (Math.max(Math.abs(x), Math.abs(y)) + radius >= step * MAX_COORDINATE) return "far";
      const changes = [];
      let room = MAX_PAINTED - painted.count;
      for (let j = Math.ceil((y - radius) / step); j * step <= y + radius; j++) {
        for (let i = Math.ceil((x - radius) / step); i * step <= x + radius; i++) {
          const was = painted.get(i, j), key = `${i},${j}`;
          if ((i * step - x) ** 2 + (j * step - y) ** 2 > radius ** 2 || was === material) continue;
          if (was < 0 && room-- <= 0) continue;
          changes.push([i, j, material]);
          if (stroke && !stroke.has(key)) stroke.set(key, [i, j, was]);
        }
      }
      apply(changes);
      return room < 0 ? "full" : null;
    },
    /** The stroke is finished. */
    end() {
      const points = [...stroke?.values() ?? []].map(([i, j, was]) => [i, j, was, painted.get(i, j)])
        .filter(([, , was, now]) => was !== now);
      stroke = null;
      remember({ points, before: settings(), after: settings() });
    },
    /** Take the stroke back. */
    cancel() {
      const back = [...stroke?.values() ?? []];
      stroke = null;
      apply(back);
    },
    undo() {
      const last = stroke ? null : done.pop();
      if (!last) return;
      undone.push(last);
      apply(last.points.map(([i, j, was]) => [i, j, was]));
      set(last.before);
      onChange();
    },
    redo() {
      const next = stroke ? null : undone.pop();
      if (!next) return;
      done.push(next);
      apply(next.points.map(([i, j, , now]) => [i, j, now]));
      set(next.after);
      onChange();
    },
    /**
     * Set how many times as densely an object stands. final: the slider was let go.
     *
     * @param {number} object
     * @param {number} factor
     * @param {boolean} final
     */
    setDensity(object, factor, final) {
      before ??= settings();
      set({ densities: densities.with(object, snap(factor, DENSITY_STEPS, [0, MAX_DENSITY])), offsets });
      if (final) this.keepSettings();
    },
    /**
     * Set what is added to the bias of each material.
     *
     * @param {number[]} wanted
     * @param {boolean} final
     */
    setOffsets(wanted, final) {
      before ??= settings();
      set({ densities, offsets: wanted.map((v) => snap(v, OFFSET_STEPS, [-MAX_OFFSET, MAX_OFFSET])) });
      if (final) this.keepSettings();
    },
    /** The settings that are dragged become a step of the history. */
    keepSettings() {
      if (before) remember({ points: [], before, after: settings() });
      before = null;
    },
    /**
     * Take all of a paint, as one step of the history, or as its beginning.
     *
     * @param {Paint} paint
     * @param {boolean} [undoable]
     */
    load(paint, undoable = true) {
      if (stroke) this.end();
      const changes = changesTo(painted, paint.runs), old = settings();
      const points = changes.map(([i, j, now]) => [i, j, painted.get(i, j), now]);
      apply(changes);
      set({ densities: paint.densities, offsets: paint.offsets });
      if (undoable) remember({ points, before: old, after: settings() });
    },
  };
}

/** @param {number[]} a @param {number[]} b */
const equal = (a, b) => a.length === b.length && a.every((v, k) => v === b[k]);
