// Frame pacing: how much is drawn while something moves, so that the frame rate holds. It starts low, so the first
// picture is quick everywhere, shrinks where frames come slowly and grows where they come fast: first the budget of
// Gaussians, down to FIRST; then the picture's resolution; then the budget again.

export const BUDGET = { least: 20_000, first: 100_000, most: 6_000_000 };
export const LEAST_SCALE = 0.3; // of the resolution along each side
const BEGIN = 0.5; // scale of the first picture
const SLOW = 24, GOAL = 21, FAST = 19; // milliseconds a frame: shrink above SLOW to reach GOAL, grow below FAST
const GROW = 1.6, RELAX = 1.01;
const FINER = 1.1; // along each side: 1.21 times the pixels, which takes a FAST frame not beyond SLOW
const WINDOW = 300, FRAMES = 3; // a decision needs this many milliseconds and frames

/** @typedef {ReturnType<typeof createFramePacing>} FramePacing */

export function createFramePacing() {
  let time = 0, frames = 0, ceiling = BUDGET.most;
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
      pacing.scale = Math.min(1, Math.max(LEAST_SCALE, pacing.scale * Math.sqrt(GOAL / took)));
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
      if (time < WINDOW || frames < FRAMES) return false;
      const mean = time / frames;
      pacing.fps = 1000 / mean;
      pacing.reset();
      if (mean > SLOW) return shrink(mean, used);
      return mean < FAST && grow(used);
    },
  };
  /** @param {number} mean @param {number} used */
  const shrink = (mean, used) => {
    const was = Math.min(pacing.budget, used), share = Math.max(0.2, GOAL / mean);
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
      pacing.scale = Math.min(1, pacing.scale * FINER);
      return false;
    }
    if (used <= 0.8 * pacing.budget) return false;
    ceiling = Math.min(BUDGET.most, ceiling * RELAX);
    const before = pacing.budget;
    pacing.budget = Math.max(before, Math.min(ceiling, before * GROW));
    return pacing.budget > 1.1 * before;
  };
  return pacing;
}
