// Numbers for developers: place, speed, times. Off until somebody asks for them.

import { element } from "./dom.js";

/**
 * @typedef {{ x: number, y: number, eye: number, under: { face?: number, i: number, j: number, tile: number }, count: number,
 *   drawn: unknown[] }} NumbersState
 * @typedef {{ now: number, state: () => NumbersState, stats: () => import("../draw/frame_stats.js").Summary,
 *   fps: number, unit: string, force: boolean }} Numbers
 */

const EVERY = 250; // milliseconds between updates
const STAGES = /** @type {const} */ (["render", "sort", "update"]);

export function createNumbers() {
  const box = element("numbers", HTMLElement), button = element("numbersButton", HTMLButtonElement);
  const [place, speed, times] = ["place", "speed", "times"].map((id) => element(id, HTMLElement));
  /** @type {Numbers | null} */
  let last = null;
  let shown = -Infinity;

  function write() {
    if (!last || box.hidden) return;
    const { state, stats, fps, unit } = last, { x, y, eye, under, count, drawn } = state(), summary = stats();
    const round = under.face !== undefined, [east, north] = round ? [`${x.toFixed(2)}°`, `${y.toFixed(2)}°`] : [length(x), length(y)];
    const where = `${east} E, ${north} N, eye ${length(eye)} ${unitName(unit)}`, face = round ? ` of face ${under.face}` : "";
    place.textContent = `tile ${under.tile} at (${under.i}, ${under.j})${face} · ${where}`;
    const rate = fps ? `${Math.round(fps)} fps, ` : "";
    speed.textContent = `${rate}${count.toLocaleString("en")} splats in ${drawn.length} tiles`;
    const parts = STAGES.flatMap((stage) => {
      const stat = summary[stage];
      return stat ? [`${stage} ${stat.mean.toFixed(1)} ± ${stat.sd.toFixed(1)} ms`] : [];
    });
    times.textContent = `${parts.join(" · ")} · worker in ${Math.round(100 * summary.share)} % of frames`;
  }
  const toggle = () => {
    box.hidden = !box.hidden;
    button.setAttribute("aria-pressed", String(!box.hidden));
    write();
  };
  button.addEventListener("click", toggle);
  return {
    toggle,
    /** Show them, a few times a second at most unless forced. @param {Numbers} numbers */
    show(numbers) {
      last = numbers;
      if (numbers.now - shown < EVERY && !numbers.force) return;
      shown = numbers.now;
      write();
    },
  };
}

/** @param {number} v */
const length = (v) => (Math.abs(v) >= 1000 ? v.toFixed(0) : v.toPrecision(3));
/** A unit after a number. @param {string} unit */
export const unitName = (unit) => (unit === "metre" ? "m" : `${unit}s`);
