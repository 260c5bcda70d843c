// The row of tools: overlays, the fly path, a picture to keep.

import { OVERLAYS } from "../draw/overlays.js";
import { element, saveFile } from "./dom.js";

/**
 * @param {import("./viewer.js").Viewer} viewer
 */
export function listenToTools(viewer) {
  const { flyPath } = viewer, overlay = element("overlay", HTMLSelectElement);
  const [record, play, save, keep] = ["record", "play", "save", "keep"].map((id) => element(id, HTMLButtonElement));
  for (const name of OVERLAYS) overlay.add(new Option(name[0].toUpperCase() + name.slice(1), name));
  overlay.addEventListener("change", () => viewer.showOverlay(overlay.selectedIndex));
  const update = () => {
    record.textContent = flyPath.mode === "record" ? "Stop" : "Record";
    play.textContent = flyPath.mode === "play" ? "Stop" : "Play";
    play.disabled = save.disabled = !flyPath.path.length;
  };
  /** @param {"record" | "play"} mode */
  const toggle = (mode) => {
    if (flyPath.mode === mode) flyPath.stop();
    else flyPath[mode]();
    viewer.redraw();
    update();
  };
  const savePath = () =>
    saveFile(new Blob([JSON.stringify(flyPath, null, 1)], { type: "application/json" }), "flight.json");
  const savePicture = async () => saveFile(await viewer.takePicture(), "terrain.png");
  record.addEventListener("click", () => toggle("record"));
  play.addEventListener("click", () => toggle("play"));
  save.addEventListener("click", savePath);
  keep.addEventListener("click", savePicture);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target === overlay) return;
    if (event.code === "KeyR") toggle("record");
    if (event.code === "KeyP") toggle("play");
    if (event.code === "KeyC") savePicture();
    if (event.code === "KeyO") {
      viewer.showOverlay((viewer.overlay + 1) % OVERLAYS.length);
      overlay.selectedIndex = viewer.overlay;
    }
  });
  setInterval(update, 250);
  update();
}
