// Frame pacing: the budget of Gaussians that holds the frame rate. It starts low, so the first picture is quick
// everywhere, shrinks where frames come slowly and grows where they come fast.

export const BUDGET = { least: 20_000, first: 100_000, most: 6_000_000 };
const SLOW = 24, GOAL = 21, FAST = 19; // milliseconds a frame: shrink above SLOW to reach GOAL, grow below FAST
const GROW = 1.6, RELAX = 1.01;
const WINDOW = 300, FRAMES = 3; // a decision needs this many milliseconds and frames

/** @typedef {ReturnType<typeof createFramePacing>} FramePacing */

export function createFramePacing() {
  let time = 0, frames = 0, ceiling = BUDGET.most;
  const pacing = {
    budget: BUDGET.first,
    fps: 0,
    /** Forget the frames so far: after a pause, the next gap says nothing about drawing. */
    reset() {
      time = frames = 0;
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
      return mean > SLOW ? shrink(mean, used) : mean < FAST && used > 0.8 * pacing.budget && grow();
    },
  };
  /** @param {number} mean @param {number} used */
  const shrink = (mean, used) => {
    const was = Math.min(pacing.budget, used);
    ceiling = Math.max(BUDGET.least, 0.9 * was); // a budget that was too large is not tried again at once
    pacing.budget = Math.min(ceiling, Math.max(BUDGET.least, was * Math.max(0.2, GOAL / mean)));
    return false;
  };
  const grow = () => {
    ceiling = Math.min(BUDGET.most, ceiling * RELAX);
    const before = pacing.budget;
    pacing.budget = Math.max(before, Math.min(ceiling, before * GROW));
    return pacing.budget > 1.1 * before;
  };
  return pacing;
}
