// The bar: overlays, a picture to keep, the link; and the fly path behind it.

import { OVERLAYS, TITLES } from "../draw/overlays.js";
import { element, saveFile, takesLetters } from "./dom.js";
import { tellValues } from "./pointer_values.js";
import { createSaving } from "./saving.js";
import { sharePlace } from "./share.js";

/**
 * @param {import("./viewer.js").Viewer} viewer
 * @param {import("./paint_keep.js").PaintKeep} paint
 */
export function listenToTools(viewer, paint) {
  const { flyPath, hud } = viewer, overlay = element("overlay", HTMLSelectElement);
  const [record, play, save] = ["record", "play", "save"].map((id) => element(id, HTMLButtonElement));
  for (const [k, name] of OVERLAYS.entries()) overlay.add(new Option(TITLES[k], name));
  let pointed = false; // the list was opened by a pointer: letters are commands again after the choice
  overlay.addEventListener("pointerdown", () => (pointed = true));
  overlay.addEventListener("keydown", () => (pointed = false));
  overlay.addEventListener("change", () => {
    viewer.showOverlay(overlay.selectedIndex);
    if (pointed) overlay.blur();
  });
  tellValues(viewer);
  const update = () => {
    record.textContent = flyPath.mode === "record" ? "Stop recording" : "Record";
    play.textContent = flyPath.mode === "play" ? "Stop playing" : "Play";
    play.disabled = save.disabled = !flyPath.path.length;
  };
  /** @param {"record" | "play"} mode */
  const toggle = (mode) => {
    if (flyPath.mode === mode) flyPath.stop();
    else flyPath[mode]();
    viewer.redraw();
    update();
    if (flyPath.mode === "record") hud.say("Recording: walk, and press R to stop.");
  };
  const savePath = () =>
    saveFile(new Blob([JSON.stringify(flyPath, null, 1)], { type: "application/json" }), "-flight.json");
  const savePicture = createSaving(viewer), share = () => sharePlace(viewer, paint);
  record.addEventListener("click", () => toggle("record"));
  play.addEventListener("click", () => toggle("play"));
  save.addEventListener("click", savePath);
  element("copyLink", HTMLButtonElement).addEventListener("click", share);
  /** @type {Record<string, () => void>} */
  const keys = {
    KeyR: () => toggle("record"), KeyP: () => toggle("play"), KeyC: savePicture, KeyL: share, KeyI: hud.numbers.toggle,
    KeyO: () => viewer.showOverlay((viewer.overlay + 1) % OVERLAYS.length),
  };
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || takesLetters(event.target)) return;
    keys[event.code]?.();
  });
  setInterval(update, 250);
  update();
}
