// The bar: overlays, the picture to save and the link to share; and the ways to go in the menu.

import { OVERLAYS, TITLES } from "../draw/overlays.js";
import { replaceAddress } from "./address.js";
import { element, listenToKeys, saveFile } from "./dom.js";
import { tellValues } from "./legend.js";
import { MODES, moveTo } from "./walker.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("./painting.js").PaintKeep} PaintKeep
 */

const EVERY = 200; // milliseconds between updates of the progress of saving
const TOO_LONG = "What is painted is too much for a link. Save it as a file.";
const SAYS = {
  walk: "Walking", fly: "Flying: forward is where you look", orbit: "Orbiting: drag to turn about what you look at",
};

/** @param {Viewer} viewer @param {PaintKeep} paint @param {import("./walker.js").Walker} walker */
export function listenToTools(viewer, paint, walker) {
  const overlay = element("overlay", HTMLSelectElement), save = createSaving(viewer);
  const share = () => sharePlace(viewer, paint), modes = [...element("modes", HTMLElement).querySelectorAll("input")];
  for (const [k, name] of OVERLAYS.entries()) overlay.add(new Option(TITLES[k], name));
  let pointed = false; // the list was opened by a pointer: letters are commands again after the choice
  overlay.addEventListener("pointerdown", () => (pointed = true));
  overlay.addEventListener("keydown", () => (pointed = false));
  overlay.addEventListener("change", () => {
    viewer.showOverlay(overlay.selectedIndex);
    if (pointed) overlay.blur();
  });
  /** Choose a way to go; who walks again stands on the ground. @param {number} number */
  const choose = (number) => {
    const mode = MODES[number % MODES.length];
    if (mode === "walk" && walker.mode !== "walk") {
      moveTo(walker, { eye: walker.floor });
      viewer.redraw();
    }
    walker.mode = mode;
    for (const radio of modes) radio.checked = radio.value === mode;
    viewer.hud.say(SAYS[mode]);
  };
  for (const [k, radio] of modes.entries()) radio.addEventListener("change", () => choose(k));
  tellValues(viewer);
  element("keep", HTMLButtonElement).addEventListener("click", save);
  element("copyLink", HTMLButtonElement).addEventListener("click", share);
  listenToKeys({
    KeyC: save, KeyL: share, KeyI: viewer.hud.numbers.toggle,
    KeyO: () => viewer.showOverlay((viewer.overlay + 1) % OVERLAYS.length),
    KeyV: () => choose(MODES.indexOf(walker.mode) + 1),
  });
}

/** A function that saves the finest picture of this place, which takes a slow device a while. @param {Viewer} viewer */
function createSaving(viewer) {
  const button = element("keep", HTMLButtonElement);
  let busy = false;
  return async () => {
    if (busy) return;
    busy = true;
    button.setAttribute("aria-busy", "true");
    const timer = setInterval(() => {
      const done = Math.round(100 * viewer.resting.done);
      viewer.hud.say(`Saving the picture: ${done} %. It is taken where you stand still.`);
    }, EVERY);
    try {
      saveFile(await viewer.takePicture(), ".png");
      viewer.hud.say("The picture is saved.");
    } catch (error) {
      viewer.fail(error);
    } finally {
      clearInterval(timer);
      button.removeAttribute("aria-busy");
      busy = false;
    }
  };
}

/** Share the address, as the device does it or on the clipboard. @param {Viewer} viewer @param {PaintKeep} paint */
async function sharePlace(viewer, paint) {
  const link = await paint.findLink();
  if (link === null) return viewer.hud.say(TOO_LONG);
  const address = new URL(location.href);
  address.hash = viewer.address(link);
  replaceAddress(address.hash);
  try {
    if (document.documentElement.classList.contains("touch") && navigator.share) {
      await navigator.share({ title: document.title, url: address.href });
      return;
    }
    await navigator.clipboard.writeText(address.href);
    viewer.hud.say("The link to this place is copied.");
  } catch (error) {
    const { name } = /** @type {Error} */ (error);
    if (name !== "AbortError") viewer.hud.say("The link to this place is in the address bar.");
  }
}
