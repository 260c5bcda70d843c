// The tour's button and key. Any input ends it; it begins when asked, by `?tour` in the address too, but then not where
// people ask for less motion.

import { element, takesLetters } from "./dom.js";

/**
 * @param {import("./viewer.js").Viewer} viewer
 * @param {() => void} closePanels
 */
export function listenToTour(viewer, closePanels) {
  const { tour, hud } = viewer, button = element("tour", HTMLButtonElement);
  const stop = () => {
    if (!tour.on) return;
    tour.stop();
    hud.say("The tour ends here: walk on.");
  };
  const start = () => {
    const { scene } = viewer;
    if (!scene) return;
    viewer.flyPath.stop();
    tour.start(scene.walker, scene.heights);
    closePanels();
    hud.say("A tour. Any key or touch ends it.");
  };
  button.addEventListener("click", start); // which no pointer reaches without ending the last one
  /** Is this the tour's own key, which ends it itself? @param {Event} event */
  const isOwn = (event) => event instanceof KeyboardEvent && event.code === "KeyT";
  for (const kind of ["keydown", "pointerdown", "wheel", "gamepadinput", "drop"]) {
    addEventListener(kind, (event) => isOwn(event) || stop(), { capture: true, passive: true });
  }
  addEventListener("keydown", (event) => {
    if (event.code !== "KeyT" || event.ctrlKey || event.metaKey || event.altKey || takesLetters(event.target)) return;
    if (tour.on) stop();
    else start();
  });
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  if (new URLSearchParams(location.search).has("tour") && !calm) start();
}
