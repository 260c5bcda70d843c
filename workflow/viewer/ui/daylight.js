// The time of day: its slider in the menu, and the key that switches the light off.

import { SUNRISE, SUNSET } from "../terrain/sun.js";
import { element, listenToKeys } from "./dom.js";

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
