// The time of day: its slider in the menu, and the key that switches the light off. And when the wind blows: over a picture at rest that is whole, where the device draws all of it in a thirtieth of a second,
// and on while somebody moves there. It is still in pictures at rest and in those that are saved, and it comes and goes
// softly, so that nothing jumps.

import { SUNRISE, SUNSET } from "../terrain/light.js";
import { element, listenToKeys } from "./dom.js";

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

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("../terrain/light.js").ChosenSun} ChosenSun
 */

const STEP = 0.25; // hours

/** An hour as a clock shows it. @param {number} hour */
export function formatClock(hour) {
  const minutes = Math.round(60 * hour);
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}`;
}

/** @param {Viewer} viewer */
export function listenToDaylight(viewer) {
  const slider = element("hour", HTMLInputElement), light = () => viewer.scene?.light;
  Object.assign(slider, { min: SUNRISE, max: SUNSET, step: STEP });
  /** @type {ChosenSun} */
  let last = null; // before the light was off
  const toggle = () => {
    const now = light()?.chosen;
    if (now === undefined) return;
    viewer.showSun(now === "off" ? last : "off");
    if (now !== "off") last = now;
    viewer.hud.say(now === "off" ? "The light is on." : "The light is off: colours are as photographed.");
  };
  slider.addEventListener("input", () => viewer.showSun(slider.valueAsNumber));
  element("capturedSun", HTMLButtonElement).addEventListener("click", () => viewer.showSun(null));
  element("lightButton", HTMLButtonElement).addEventListener("click", toggle);
  listenToKeys({ KeyK: toggle });
}

/** Show which sun is chosen. @param {import("../terrain/light.js").Light | null} light */
export function showDaylight(light) {
  element("daylight", HTMLElement).hidden = !light;
  if (!light) return;
  const { chosen, capturedHour } = light, slider = element("hour", HTMLInputElement);
  const hour = typeof chosen === "number" ? chosen : capturedHour;
  const clock = `${formatClock(hour)}${chosen === null ? ", as photographed" : ""}`;
  slider.value = String(hour);
  slider.disabled = chosen === "off";
  slider.setAttribute("aria-valuetext", `${clock}, solar time`);
  element("clock", HTMLOutputElement).textContent = chosen === "off" ? "off" : formatClock(hour);
  element("capturedSun", HTMLButtonElement).disabled = chosen === null;
  element("lightButton", HTMLButtonElement).setAttribute("aria-pressed", String(chosen !== "off"));
}
