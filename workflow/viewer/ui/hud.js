// Texts of the page: progress while loading, place and speed, help, errors.

import { OBJECTS, materialColour } from "../draw/overlays.js";
import { element, swatch } from "./dom.js";

/**
 * What the numbers show.
 * @typedef {{ x: number, y: number, eye: number, under: { i: number, j: number, tile: number }, count: number,
 *   drawn: unknown[] }} HudState
 * @typedef {ReturnType<typeof createHud>} Hud
 */

const EVERY = 250; // milliseconds between updates
const STAGES = /** @type {const} */ (["render", "sort", "update"]);

export function createHud() {
  const loading = element("loading", HTMLElement), error = element("error", HTMLElement);
  const status = element("status", HTMLElement), bar = element("bar", HTMLProgressElement);
  const place = element("place", HTMLElement), speed = element("speed", HTMLElement);
  const times = element("times", HTMLElement), tools = element("tools", HTMLElement);
  const legend = element("legend", HTMLElement), help = createHelp(), footer = /** @type {HTMLElement} */ (place.parentElement);
  let announced = -Infinity, numbered = -Infinity;
  error.addEventListener("click", () => (error.hidden = true));
  footer.hidden = tools.hidden = true;

  return {
    /** Bytes and chunks so far. @param {import("../data/bundle.js").Progress} progress */
    showProgress({ bytes, total, chunks, of }) {
      bar.value = total ? bytes / total : 1;
      const now = performance.now();
      if (now - announced < EVERY) return; // a screen reader reads every change of the status aloud
      announced = now;
      const share = `${megabytes(bytes)} of ${megabytes(total)} MB`;
      status.textContent = `Loading the terrain: ${share}, ${chunks} of ${of} pieces ready`;
    },
    /** All is loaded; a first visit begins with help. @param {boolean} quiet without it */
    showLoaded(quiet) {
      loading.hidden = true;
      status.textContent = "";
      if (!quiet && !wasVisited()) help.show(true);
    },
    /** @param {string} text */
    showError(text) {
      loading.hidden = true;
      error.hidden = false;
      error.textContent = text;
      help.show(false);
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
    showTools() {
      footer.hidden = tools.hidden = false;
    },
    /**
     * The names of the colours in the overlay of materials; null: none are shown.
     *
     * @param {import("../data/manifest.js").Manifest | null} manifest
     */
    showLegend(manifest) {
      const names = manifest?.materials.map(({ name }, m) => ({ name, number: m })) ?? [];
      if (manifest?.objects?.length) names.push({ name: "objects", number: OBJECTS });
      legend.hidden = !manifest;
      legend.replaceChildren(...names.map(({ name, number }) => {
        const item = document.createElement("li");
        item.append(swatch(materialColour(number)), name);
        return item;
      }));
    },
    /**
     * Place, speed and times; a few times a second at most, unless forced.
     *
     * @param {{ now: number, state: () => HudState, stats: import("../draw/frame_stats.js").Summary, fps: number,
     *   unit: string, force: boolean }} numbers
     */
    showNumbers({ now, state, stats, fps, unit, force }) {
      if (now - numbered < EVERY && !force) return;
      numbered = now;
      const { x, y, eye, under, count, drawn } = state();
      const where = `${length(x)} E, ${length(y)} N, eye ${length(eye)} ${unitName(unit)}`;
      place.textContent = `tile ${under.tile} at (${under.i}, ${under.j}) · ${where}`;
      const rate = fps ? `${Math.round(fps)} fps, ` : "";
      speed.textContent = `${rate}${count.toLocaleString("en")} splats in ${drawn.length} tiles`;
      const parts = STAGES.flatMap((stage) => {
        const stat = stats[stage];
        return stat ? [`${stage} ${stat.mean.toFixed(1)} ± ${stat.sd.toFixed(1)} ms`] : [];
      });
      times.textContent = `${parts.join(" · ")} · worker in ${Math.round(100 * stats.share)} % of frames`;
    },
  };
}

function createHelp() {
  const help = element("help", HTMLElement), button = element("helpButton", HTMLButtonElement);
  /** @param {boolean} on */
  const show = (on) => {
    help.hidden = !on;
    button.setAttribute("aria-expanded", String(on));
  };
  button.addEventListener("click", () => show(Boolean(help.hidden)));
  element("helpClose", HTMLButtonElement).addEventListener("click", () => {
    show(false);
    rememberVisit();
  });
  return { show };
}

/** @param {number} bytes */
const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
/** @param {number} v */
const length = (v) => (Math.abs(v) >= 1000 ? v.toFixed(0) : v.toPrecision(3));
/** @param {string} unit */
const unitName = (unit) => (unit === "metre" ? "m" : `${unit}s`);

function wasVisited() {
  try {
    return localStorage.getItem("davgswt.visited") === "yes";
  } catch {
    return false; // storage may be switched off
  }
}

function rememberVisit() {
  try {
    localStorage.setItem("davgswt.visited", "yes");
  } catch {
    // then the help is shown again next time
  }
}
