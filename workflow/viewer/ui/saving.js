// Saving a picture: the finest of this place, which takes a slow device a while; the button shows how far it is.

import { element, saveFile } from "./dom.js";

const EVERY = 200; // milliseconds between updates

/** @param {import("./viewer.js").Viewer} viewer */
export function createSaving(viewer) {
  const button = element("keep", HTMLButtonElement), bar = document.createElement("progress");
  let busy = false;
  bar.setAttribute("aria-label", "Saving the picture");
  const save = async () => {
    if (busy) return;
    busy = true;
    button.setAttribute("aria-busy", "true");
    const timer = setInterval(() => {
      bar.value = viewer.resting.done;
      if (!bar.isConnected) button.append(bar);
      viewer.hud.say(`Saving the picture: ${Math.round(100 * bar.value)} %. It is taken where you stand still.`);
    }, EVERY);
    try {
      saveFile(await viewer.takePicture(), ".png");
      viewer.hud.say("The picture is saved.");
    } catch (error) {
      viewer.fail(error);
    } finally {
      clearInterval(timer);
      bar.remove();
      button.removeAttribute("aria-busy");
      busy = false;
    }
  };
  button.addEventListener("click", save);
  return save;
}
