// The first view: the scene's name, a still until the terrain itself is as sharp, and a hint until the first step.

import { element } from "./dom.js";

const FADE = 700; // milliseconds, a little longer than in style.css
const STEP = 0.02; // of the eye's height; a turn by degrees counts alike

/** @typedef {ReturnType<typeof createFirstView>} FirstView */

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
    /** A picture was drawn. @param {import("./walker.js").Walker} place @param {number} overlay */
    note(place, overlay) {
      if (overlay) showTerrain();
      if (!begin || !isStep(begin, place)) return;
      begin = null;
      hint.hidden = true;
      title.classList.add("leaving");
      showTerrain();
      onStep();
    },
  };
}

/** @param {import("./walker.js").Walker} a @param {import("./walker.js").Walker} b */
const isStep = (a, b) => Math.hypot(unitsOf(b, a.x - b.x), unitsOf(b, a.y - b.y), a.eye - b.eye) > STEP * a.eye
  || Math.abs(a.yaw - b.yaw) + Math.abs(a.pitch - b.pitch) > 100 * STEP;

/** World units of a change of x or y, which are degrees on a planet. @param {import("./walker.js").Walker} walker @param {number} change */
const unitsOf = ({ radius }, change) => (radius ? (change * radius * Math.PI) / 180 : change);
