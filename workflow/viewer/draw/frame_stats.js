// Means and standard deviations over the last frames, for the numbers on the page.

const WINDOW = 120;

/**
 * `share`: of frames for which the worker had answered since the last.
 * @typedef {{ mean: number, sd: number, n: number }} Stat
 * @typedef {{ share: number, render?: Stat, sort?: Stat, update?: Stat }} Summary
 * @typedef {"render" | "sort" | "update"} Stage
 */

export function createFrameStats() {
  /** @type {Map<Stage, number[]>} */
  const times = new Map();
  /** @type {number[]} */
  const answered = [];
  /** @param {number[]} list @param {number} value */
  const keep = (list, value) => {
    list.push(value);
    if (list.length > WINDOW) list.shift();
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
