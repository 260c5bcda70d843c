// Ways to go: walk, fly, orbit.

import { element, takesLetters } from "./dom.js";
import { MODES, moveTo } from "./walker.js";

const SAYS = { walk: "Walking", fly: "Flying: forward is where you look", orbit: "Orbiting: drag to turn about what you look at" };

/**
 * Let a person choose; who walks again stands on the ground, wherever he flew.
 *
 * @param {import("./walker.js").Walker} walker
 * @param {(text: string) => void} say
 * @param {() => void} onChange a picture is due
 */
export function listenToModes(walker, say, onChange) {
  const radios = [...element("modes", HTMLElement).querySelectorAll("input")];
  /** @param {import("./walker.js").Mode} mode */
  const choose = (mode) => {
    if (mode === "walk" && walker.mode !== "walk") {
      moveTo(walker, { eye: walker.floor });
      onChange();
    }
    walker.mode = mode;
    for (const radio of radios) radio.checked = radio.value === mode;
    say(SAYS[mode]);
  };
  for (const [k, radio] of radios.entries()) radio.addEventListener("change", () => choose(MODES[k]));
  addEventListener("keydown", (event) => {
    if (event.code !== "KeyV" || event.ctrlKey || event.metaKey || event.altKey || takesLetters(event.target)) return;
    choose(MODES[(MODES.indexOf(walker.mode) + 1) % MODES.length]);
  });
}
