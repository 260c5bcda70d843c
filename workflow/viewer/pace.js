// How many Gaussians a picture may have: fewer where frames come slowly, more where they come fast. Few at first, so
// that the first picture is quick everywhere.

export const BUDGET = { least: 20_000, first: 100_000, most: 6_000_000 };
const SLOW = 24, GOAL = 21, FAST = 19; // milliseconds a frame: above the first shrink to the next, below the last grow
const GROW = 1.6, RELAX = 1.01;
const RECKON = 300, FRAMES = 3; // a verdict needs so many milliseconds and frames

export function createPace() {
  let time = 0, frames = 0, ceiling = BUDGET.most;
  const pace = {
    budget: BUDGET.first,
    fps: 0,
    /** Forget the frames so far: after a rest, the next gap says nothing about drawing. */
    rest() {
      time = frames = 0;
    },
    /** A frame came `gap` milliseconds after the last, which had `used` Gaussians. Returns: may more be drawn? */
    frame(gap, used) {
      time += gap;
      frames += 1;
      if (time < RECKON || frames < FRAMES) return false;
      const mean = time / frames;
      pace.fps = 1000 / mean;
      pace.rest();
      return mean > SLOW ? shrink(mean, used) : mean < FAST && used > 0.8 * pace.budget && grow();
    },
  };
  const shrink = (mean, used) => {
    const was = Math.min(pace.budget, used);
    ceiling = Math.max(BUDGET.least, 0.9 * was); // what was too much once is not tried again at once: no to and fro
    pace.budget = Math.min(ceiling, Math.max(BUDGET.least, was * Math.max(0.2, GOAL / mean)));
    return false;
  };
  const grow = () => {
    ceiling = Math.min(BUDGET.most, ceiling * RELAX);
    const before = pace.budget;
    pace.budget = Math.max(before, Math.min(ceiling, before * GROW));
    return pace.budget > 1.1 * before;
  };
  return pace;
}
