// Pacing: what is drawn when. While something moves, frames hold the rate; at rest pictures become finer; while chunks
// arrive, previews are drawn. Means of the last frames are kept for the numbers on the page.

import { hasPassed } from "./gl.js";

export const BUDGET = { least: 20_000, first: 100_000, most: 6_000_000 };
const LEAST_SCALE = 0.3; // of the resolution along each side
const BEGIN = 0.5; // scale of the first picture
const REFRESH = 1000 / 60; // milliseconds a frame at most that is shown at once
const SLOW = 1.44, GOAL = 1.26, FAST = 1.14; // refreshes a frame: shrink above SLOW to reach GOAL, grow below FAST
const GROW = 1.6, RELAX = 1.01;
const FINER = 1.1; // along each side: 1.21 times the pixels, which takes a FAST frame not beyond SLOW
const WINDOW = 300, FRAMES = 3; // a decision needs this many milliseconds and frames
const SEARCH = { window: 170, grow: 2.5, finer: 1.35 }; // the same until the device's limit is met
const DELAY = 300; // milliseconds without a change until the first picture at rest
const STEPS = [250_000, 1_000_000, BUDGET.most]; // budgets of the pictures at rest
const MORE = 1.5; // times the Gaussians of the picture before, at least: less is hardly seen
const SHARE = 5; // times a preview's own duration that passes before the next
const KEPT = 120; // frames whose times are kept

/**
 * `share`: of frames for which the worker had answered since the last.
 * @typedef {{ mean: number, sd: number, n: number }} Stat
 * @typedef {{ share: number, render?: Stat, sort?: Stat, update?: Stat }} Summary
 * @typedef {"render" | "sort" | "update"} Stage
 */

/**
 * How much is drawn while something moves, so that the frame rate holds. It starts low, so the first picture is quick
 * everywhere, shrinks where frames come slowly and grows where they come fast: first the budget of Gaussians, down to
 * FIRST; then the picture's resolution; then the budget again. Until frames come slowly for the first time it grows in
 * long steps, so that a fast device has all within two seconds.
 *
 * @param {number} [refresh] milliseconds from one refresh of the display to the next
 */
export function createFramePacing(refresh = REFRESH) {
  let time = 0, frames = 0, ceiling = BUDGET.most, searching = true;
  const pacing = {
    budget: BUDGET.first,
    scale: BEGIN,
    fps: 0,
    /** Forget the frames so far: after a pause, the next gap says nothing about drawing. */
    reset() {
      time = frames = 0;
    },
    /** Begin with what the GPU can do: it took so many milliseconds for a picture. @param {number} took */
    begin(took) {
      pacing.scale = Math.min(1, Math.max(LEAST_SCALE, pacing.scale * Math.sqrt((GOAL * refresh) / took)));
    },
    /**
     * A frame came `gap` milliseconds after the last and had `used` Gaussians. Returns: may clearly more be drawn?
     *
     * @param {number} gap @param {number} used
     */
    addFrame(gap, used) {
      time += gap;
      frames += 1;
      if (time < (searching ? SEARCH.window : WINDOW) || frames < FRAMES) return false;
      const mean = time / frames;
      pacing.fps = 1000 / mean;
      pacing.reset();
      if (mean > SLOW * refresh) return shrink(mean, used);
      return mean < FAST * refresh && grow(used);
    },
  };
  /** @param {number} mean @param {number} used */
  const shrink = (mean, used) => {
    const was = Math.min(pacing.budget, used), share = Math.max(0.2, (GOAL * refresh) / mean);
    searching = false;
    if (was <= BUDGET.first && pacing.scale > LEAST_SCALE) {
      pacing.scale = Math.max(LEAST_SCALE, pacing.scale * Math.sqrt(share));
      return false;
    }
    const least = pacing.scale > LEAST_SCALE ? BUDGET.first : BUDGET.least;
    ceiling = Math.max(least, 0.9 * was); // a budget that was too large is not tried again at once
    pacing.budget = Math.min(ceiling, Math.max(least, was * share));
    return false;
  };
  /** @param {number} used */
  const grow = (used) => {
    if (pacing.scale < 1 && pacing.budget >= BUDGET.first) {
      pacing.scale = Math.min(1, pacing.scale * (searching ? SEARCH.finer : FINER));
      return false;
    }
    if (used <= 0.8 * pacing.budget) return false;
    ceiling = Math.min(BUDGET.most, ceiling * RELAX);
    const before = pacing.budget;
    pacing.budget = Math.max(before, Math.min(ceiling, before * (searching ? SEARCH.grow : GROW)));
    return pacing.budget > 1.1 * before;
  };
  return pacing;
}

/** Pictures at rest: the same place again with ever more Gaussians until all are drawn, on every device. */
export function createRest() {
  let since = 0, budget = 0, whole = false;
  return {
    /** Is everything drawn that there is to draw here? */
    get whole() {
      return whole;
    },
    /**
     * Something changed: pictures start over from what is drawn while it does.
     *
     * @param {number} now
     * @param {number} drawn budget
     */
    restart(now, drawn) {
      [since, budget, whole] = [now, drawn, false];
    },
    /** The next picture's budget if it is due, or null; `finish` follows. @param {number} now */
    next(now) {
      if (whole || now - since < DELAY) return null;
      return STEPS.find((step) => step >= MORE * budget) ?? BUDGET.most;
    },
    /**
     * A picture is shown.
     *
     * @param {number} drawn its budget
     * @param {boolean} all did the budget leave nothing out?
     */
    finish(drawn, all) {
      budget = drawn;
      whole = all || drawn >= BUDGET.most;
    },
    /** How much of all the work is done when a share of the picture with this budget is. @param {number} drawn @param {number} share */
    progress(drawn, share) {
      const before = STEPS.filter((step) => step < drawn).reduce((sum, step) => sum + step, 0);
      return (before + share * drawn) / STEPS.reduce((sum, step) => sum + step, 0);
    },
  };
}

/**
 * Previews while chunks arrive. The first is drawn when the coarsest level is there, the next when the one before is
 * finished and most of the time since went to loading. On a slow machine previews would otherwise delay the chunks.
 *
 * @param {import("./gl.js").GL} gl
 */
export function createPreview(gl) {
  let start = 0, next = 0, took = 0;
  /** @type {WebGLSync | null} */
  let fence = null;
  return {
    /** Milliseconds that the last finished picture took; 0: there is none. */
    get took() {
      return took;
    },
    /** May a preview be drawn? @param {number} now @param {boolean} ready has the coarsest level? */
    isDue(now, ready) {
      if (fence) {
        if (!hasPassed(gl, fence)) return false;
        gl.deleteSync(fence);
        fence = null;
        took = now - start;
        next = now + SHARE * took;
      }
      if (now < next || !ready) return false;
      start = now;
      return true;
    },
    /** A preview was handed to the GPU. */
    addPicture() {
      fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    },
  };
}

/** Means and standard deviations over the last frames. */
export function createFrameStats() {
  /** @type {Map<Stage, number[]>} */
  const times = new Map();
  /** @type {number[]} */
  const answered = [];
  /** @param {number[]} list @param {number} value */
  const keep = (list, value) => {
    list.push(value);
    if (list.length > KEPT) list.shift();
  };
  return {
    /** @param {Stage} stage @param {number} milliseconds */
    addTime(stage, milliseconds) {
      if (!times.has(stage)) times.set(stage, []);
      keep(times.get(stage) ?? [], milliseconds);
    },
    /** A frame was drawn. @param {boolean} fresh the worker has answered since the last */
    addFrame: (fresh) => keep(answered, Number(fresh)),
    /** @returns {Summary} */
    summary() {
      /** @type {Summary} */
      const summary = { share: mean(answered) };
      for (const [stage, list] of times) {
        const middle = mean(list);
        const sd = Math.sqrt(list.reduce((sum, v) => sum + (v - middle) ** 2, 0) / Math.max(1, list.length - 1));
        summary[stage] = { mean: middle, sd, n: list.length };
      }
      return summary;
    },
  };
}

/** @param {number[]} list */
const mean = (list) => (list.length ? list.reduce((a, b) => a + b, 0) / list.length : 0);
