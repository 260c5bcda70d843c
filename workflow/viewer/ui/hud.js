// Texts of the page: progress of loading and of a sharper picture, short messages, errors, and numbers for developers.

import { element } from "./dom.js";
import { createLegend, unitName } from "./legend.js";

/**
 * @typedef {ReturnType<typeof createHud>} Hud
 * @typedef {{ x: number, y: number, eye: number, under: { face?: number, i: number, j: number, tile: number },
 *   count: number, drawn: unknown[] }} NumbersState
 * @typedef {{ now: number, state: () => NumbersState, stats: () => import("../draw/pacing.js").Summary, fps: number,
 *   unit: string, force: boolean }} Numbers
 */

const EVERY = 250; // milliseconds between updates
const ASKED = 50e6; // bytes: a phone loads more only when its user agrees
const PHONE = 600; // CSS pixels of the shorter side of the screen, fewer than a tablet's
const READ = 4000; // milliseconds that a message stays
const STAGES = /** @type {const} */ (["render", "sort", "update"]);

export function createHud() {
  const loading = element("loading", HTMLElement), error = element("error", HTMLElement);
  const status = element("status", HTMLElement), bar = element("bar", HTMLProgressElement);
  const refining = element("refining", HTMLProgressElement), toast = element("toast", HTMLElement);
  let announced = -Infinity, timer = 0;
  error.addEventListener("click", () => (error.hidden = true));

  return {
    numbers: createNumbers(),
    legend: createLegend(),
    /** Bytes so far. @param {import("../data/bundle.js").Progress} progress */
    showProgress({ bytes, total }) {
      bar.value = total ? bytes / total : 1;
      const now = performance.now();
      if (now - announced < EVERY) return; // a screen reader reads every change of the status aloud
      announced = now;
      status.textContent = `Loading ${megabytes(bytes)} of ${megabytes(total)} MB`;
    },
    /** Ask before a large download on a phone; resolves on consent. @param {number} bytes @returns {Promise<void>} */
    askToLoad(bytes) {
      const isPhone = matchMedia("(pointer: coarse)").matches && Math.min(screen.width, screen.height) < PHONE;
      if (!isPhone || bytes <= ASKED) return Promise.resolve();
      const agree = element("agree", HTMLButtonElement);
      status.textContent = "This terrain is large. On a mobile network the download may cost you.";
      agree.textContent = `Load up to ${Math.round(bytes / 1e6)} MB`;
      agree.hidden = false;
      return new Promise((done) => agree.addEventListener("click", () => {
        agree.hidden = true;
        done();
      }, { once: true }));
    },
    /** All is loaded. */
    showLoaded() {
      loading.hidden = true;
      status.textContent = "";
    },
    /** @param {string} text */
    showError(text) {
      loading.hidden = true;
      error.hidden = false;
      error.textContent = text;
    },
    hideError() {
      error.hidden = true;
    },
    /** Another bundle was dropped. */
    showOpening() {
      error.hidden = true;
      loading.hidden = false;
      bar.value = 0;
      status.textContent = "Reading what was dropped";
    },
    /** How much of the finest picture is drawn, 0 to 1; null: nothing is under way. @param {number | null} share */
    showRefining(share) {
      refining.hidden = share === null;
      refining.value = share ?? 0;
    },
    /** Show a short message for a while. @param {string} text */
    say(text) {
      toast.textContent = text;
      clearTimeout(timer);
      timer = setTimeout(() => (toast.textContent = ""), READ);
    },
  };
}

/** Numbers for developers: place, speed, times. They are hidden at first. */
function createNumbers() {
  const box = element("numbers", HTMLElement), button = element("numbersButton", HTMLButtonElement);
  const [place, speed, times] = ["place", "speed", "times"].map((id) => element(id, HTMLElement));
  /** @type {Numbers | null} */
  let last = null;
  let shown = -Infinity;

  function write() {
    if (!last || box.hidden) return;
    const { state, stats, fps, unit } = last, { x, y, eye, under, count, drawn } = state(), summary = stats();
    const round = under.face !== undefined;
    const [east, north] = round ? [`${x.toFixed(2)}°`, `${y.toFixed(2)}°`] : [length(x), length(y)];
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
/** @param {number} bytes */
const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
