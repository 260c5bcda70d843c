// When the wind blows: over a picture at rest that is whole, where the device draws all of it in a thirtieth of a second,
// and on while somebody moves there. It is still in pictures at rest and in those that are saved, and it comes and goes
// softly, so that nothing jumps.

import { element } from "./dom.js";

const RISE = 2, FALL = 0.2; // seconds until it blows, and until it is still: sooner than a picture at rest begins
const LONGEST = 34; // milliseconds of a picture, and on average between pictures in the wind
const TRIAL = 20; // pictures of that average
const MAX_STEP = 250; // milliseconds of one picture at most, as after a pause

const query = matchMedia("(prefers-reduced-motion: reduce)");
let calm = query.matches; // less motion is asked for; asking the query itself would keep Chromium from telling of a change

/** @typedef {ReturnType<typeof createWind>} Wind */

export function createWind() {
  let seconds = 0, share = 0, on = true, pictures = 0, mean = 0, slow = false;
  return {
    /** What pictures show; null: still air. @returns {import("../draw/wind.js").Wind | null} */
    get now() {
      return share > 0 ? { seconds, share: share * share * (3 - 2 * share) } : null;
    },
    get on() {
      return on;
    },
    /** Switch it, and try again what was too slow. @param {boolean} wanted */
    switch(wanted) {
      [on, slow, pictures] = [wanted, false, 0];
    },
    /** A picture without wind is shown. */
    still() {
      share = pictures = 0;
    },
    /**
     * Go on. Returns: is a picture due?
     *
     * @param {number} gap milliseconds since the last turn
     * @param {number} took milliseconds of a whole picture
     * @param {{ sways: boolean, whole: boolean, moving: boolean }} scene sways: does anything there?
     */
    step(gap, took, { sways, whole, moving }) {
      const before = share, step = Math.min(gap, MAX_STEP);
      if (whole && before > 0) {
        pictures += 1;
        mean += (step - mean) / Math.min(pictures, TRIAL);
        if (pictures > TRIAL && mean > LONGEST) slow = true;
      }
      const blows = on && !calm && !slow && sways && took <= LONGEST && (whole || (moving && before > 0));
      share = Math.min(1, Math.max(0, before + (blows ? 1 / RISE : -1 / FALL) * (step / 1000)));
      seconds += step / 1000;
      return before > 0 || share > 0;
    },
  };
}

/** The wind's button. @param {import("./viewer.js").Viewer} viewer */
export function listenToWind(viewer) {
  element("windButton", HTMLButtonElement).addEventListener("click", () => viewer.showWind(!viewer.wind.on));
  query.addEventListener("change", ({ matches }) => {
    calm = matches;
    viewer.showWind(viewer.wind.on);
  });
}

/** Show whether it blows. @param {Wind} wind @param {import("../data/manifest.js").Manifest} manifest */
export function showWindButton({ on }, manifest) {
  const button = element("windButton", HTMLButtonElement);
  button.hidden = !manifest.wind || calm;
  button.setAttribute("aria-pressed", String(on));
}
