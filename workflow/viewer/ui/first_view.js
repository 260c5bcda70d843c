// The first view: the scene's name, a still until the terrain itself is as sharp, and a hint until the first step.

import { element } from "./dom.js";
import { PLACE_KEYS } from "./walker.js";

const FADE = 700; // milliseconds, a little longer than in style.css

/** @param {{ onStep: () => void }} handlers called when somebody moves */
export function createFirstView({ onStep }) {
  const title = element("title", HTMLElement), hint = element("hint", HTMLElement);
  /** @type {import("./walker.js").Walker | null} */
  let begin = null;
  const showTerrain = () => {
    const still = document.getElementById("first");
    if (!still || still.classList.contains("leaving")) return;
    still.classList.add("leaving");
    setTimeout(() => still.remove(), FADE);
  };
  addEventListener("pointerdown", ({ pointerType }) => {
    document.documentElement.classList.toggle("touch", pointerType === "touch");
  });

  return {
    showTerrain,
    /** A terrain was opened. @param {import("./walker.js").Walker} place @param {boolean} own the page's own */
    showScene(place, own) {
      begin = { ...place };
      title.classList.remove("leaving");
      const name = element("name", HTMLElement), line = element("line", HTMLElement);
      if (!own) {
        showTerrain();
        [name.textContent, line.textContent] = ["Your terrain", "Dropped onto this page"];
      }
      element("about", HTMLElement).textContent = `${name.textContent}: ${line.textContent}`; // the title itself leaves
    },
    /** There is something to walk on. */
    showHint() {
      hint.hidden = begin === null;
    },
    /**
     * A picture was drawn.
     *
     * @param {import("./walker.js").Walker} place
     * @param {boolean} other than the still: an overlay, another sun
     */
    note(place, other) {
      if (other) showTerrain();
      const start = begin;
      if (!start || PLACE_KEYS.every((key) => place[key] === start[key])) return;
      begin = null;
      hint.hidden = true;
      title.classList.add("leaving");
      showTerrain();
      onStep();
    },
  };
}
