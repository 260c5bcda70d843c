// Pictures at rest: while nothing moves, the same place again with ever more Gaussians until all are drawn, on every
// device. Each is drawn in slices beside the shown one (see sliced_picture.js), so that nobody waits for it.

import { BUDGET } from "./frame_pacing.js";

const DELAY = 300; // milliseconds without a change
const STEPS = [250_000, 1_000_000, BUDGET.most]; // budgets of the pictures
const MORE = 1.5; // times the Gaussians of the picture before, at least: less is hardly seen

/** @typedef {ReturnType<typeof createRest>} Rest */

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
    /**
     * The budget of the next picture if it is due, or null. Call `finish` when it is shown.
     *
     * @param {number} now
     */
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
