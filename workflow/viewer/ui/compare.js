// Side by side: the terrain on the left of a divider, an overlay of the same view on its right.

import { OVERLAYS, TITLES } from "../draw/overlays.js";
import { element, takesLetters } from "./dom.js";

const LEAST = 0.02, MOST = 0.98; // share of the picture on the left
const STEP = 0.05; // of an arrow key
/** @type {Record<string, (split: number) => number>} */
const KEYS = {
  ArrowLeft: (split) => split - STEP, ArrowDown: (split) => split - STEP, ArrowRight: (split) => split + STEP,
  ArrowUp: (split) => split + STEP, Home: () => LEAST, End: () => MOST,
};

/** @param {import("./viewer.js").Viewer} viewer */
export function createCompare(viewer) {
  const button = element("compare", HTMLButtonElement), divider = element("divider", HTMLElement);
  const right = element("dividerOverlay", HTMLElement);
  let shown = -1; // overlay

  /** @param {number} split 0: no divider */
  function set(split) {
    const value = split && Math.min(Math.max(split, LEAST), MOST);
    if (value === viewer.split) return;
    viewer.split = value;
    divider.hidden = value === 0;
    divider.style.left = `${100 * value}%`;
    divider.ariaValueNow = String(Math.round(100 * value));
    button.setAttribute("aria-pressed", String(value > 0));
    viewer.redraw();
  }
  /** A level is the first overlay that a comparison shows if there is none. */
  const toggle = () => {
    if (!viewer.overlay) viewer.showOverlay(OVERLAYS.indexOf("level"));
    set(viewer.split ? 0 : 0.5);
  };
  button.addEventListener("click", toggle);
  addEventListener("keydown", (event) => {
    if (event.code !== "KeyB" || event.ctrlKey || event.metaKey || event.altKey || takesLetters(event.target)) return;
    toggle();
  });
  divider.addEventListener("keydown", (event) => {
    const move = KEYS[event.code];
    if (!move) return;
    event.preventDefault();
    set(move(viewer.split));
  });
  divider.addEventListener("pointerdown", ({ pointerId }) => divider.setPointerCapture(pointerId));
  divider.addEventListener("pointermove", ({ pointerId, clientX }) => {
    if (divider.hasPointerCapture(pointerId)) set(clientX / viewer.canvas.clientWidth);
  });
  return {
    /** A picture was drawn. */
    update() {
      if (viewer.overlay === shown) return;
      shown = viewer.overlay;
      button.hidden = shown === 0;
      right.textContent = TITLES[shown];
      if (!shown) set(0);
    },
  };
}
