// Frame pacing: how much is drawn while something moves, so that the frame rate holds. It starts low, so the first
// picture is quick everywhere, shrinks where frames come slowly and grows where they come fast: first the budget of
// Gaussians, down to FIRST; then the picture's resolution; then the budget again. Until frames come slowly for the
// first time it grows in long steps, so that a fast device has all within two seconds.

export const BUDGET = { least: 20_000, first: 100_000, most: 6_000_000 };
export const LEAST_SCALE = 0.3; // of the resolution along each side
const BEGIN = 0.5; // scale of the first picture
const REFRESH = 1000 / 60; // milliseconds a frame at most that is shown at once
const SLOW = 1.44, GOAL = 1.26, FAST = 1.14; // refreshes a frame: shrink above SLOW to reach GOAL, grow below FAST
const GROW = 1.6, RELAX = 1.01;
const FINER = 1.1; // along each side: 1.21 times the pixels, which takes a FAST frame not beyond SLOW
const WINDOW = 300, FRAMES = 3; // a decision needs this many milliseconds and frames
const SEARCH = { window: 170, grow: 2.5, finer: 1.35 }; // the same until the device's limit is met

/**
 * What a device could draw: a budget of Gaussians and a scale of the resolution.
 * @typedef {{ budget: number, scale: number }} Pace
 * @typedef {ReturnType<typeof createFramePacing>} FramePacing
 */

/** @param {number} [refresh] milliseconds from one refresh of the display to the next */
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
    /** Begin with what this device could draw before. @param {Pace} pace */
    resume({ budget, scale }) {
      Object.assign(pacing, { budget, scale });
      searching = false;
    },
    /**
     * A frame came `gap` milliseconds after the last and had `used` Gaussians. Returns: may clearly more be drawn?
     *
     * @param {number} gap
     * @param {number} used
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
