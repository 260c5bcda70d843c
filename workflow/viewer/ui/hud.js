// Texts of the page: progress of loading and of a sharper picture, short messages, errors.

import { element } from "./dom.js";
import { createLegend } from "./legend.js";
import { createNumbers } from "./numbers.js";

/** @typedef {ReturnType<typeof createHud>} Hud */

const EVERY = 250; // milliseconds between updates
const ASKED = 50e6; // bytes: a phone loads more only when its user agrees
const PHONE = 600; // CSS pixels of the shorter side of the screen, fewer than a tablet's
const READ = 4000; // milliseconds that a message stays

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
    /**
     * On a phone, ask before much is downloaded. Resolves when the person agrees, at once where nothing is asked.
     *
     * @param {number} bytes
     * @returns {Promise<void>}
     */
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
    showTools() {
      element("tools", HTMLElement).hidden = false;
    },
    /** How much of the finest picture is drawn, 0 to 1; null: nothing is under way. @param {number | null} share */
    showRefining(share) {
      refining.hidden = share === null;
      refining.value = share ?? 0;
    },
    /** A short message, which goes again. @param {string} text */
    say(text) {
      toast.textContent = text;
      clearTimeout(timer);
      timer = setTimeout(() => (toast.textContent = ""), READ);
    },
  };
}

/** @param {number} bytes */
const megabytes = (bytes) => (bytes / 1e6).toFixed(1);
