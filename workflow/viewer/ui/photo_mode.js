// Photo mode: a picture of all Gaussians to keep, of a size and a field of view that one chooses.

import { BUDGET } from "../draw/frame_pacing.js";
import { FIELD_OF_VIEW } from "../terrain/camera.js";
import { capturing } from "./capture.js";
import { element, saveFile, takesLetters } from "./dom.js";
import { createPanel } from "./panel.js";

/** @typedef {{ width: number, height: number }} Size pixels */

const TIMES = [1, 2, 4]; // as large as what is shown, along each side
const MOST_PIXELS = 2 ** 24; // the largest canvas that all browsers have
const LARGER = 1.25; // along each side: what is less is no choice of its own

/**
 * Sizes to choose from, in the shape of what is shown; the last ones are bounded by the device.
 *
 * @param {Size} shown
 * @param {number} longest side that the device draws
 * @returns {Size[]}
 */
export function photoSizes({ width, height }, longest) {
  const most = Math.min(longest / Math.max(width, height), Math.sqrt(MOST_PIXELS / (width * height)));
  const times = TIMES.map((factor) => Math.min(factor, most));
  return times.filter((factor, k) => k === 0 || factor >= LARGER * times[k - 1])
    .map((factor) => ({ width: Math.floor(width * factor), height: Math.floor(height * factor) }));
}

/**
 * @param {import("./viewer.js").Viewer} viewer
 * @param {import("./job.js").Jobs} jobs
 * @param {() => void} onView called when another field of view is shown
 */
export function createPhotoMode(viewer, jobs, onView) {
  const size = element("photoSize", HTMLSelectElement), view = element("photoView", HTMLInputElement);
  const said = element("photoViewText", HTMLOutputElement), take = element("photoTake", HTMLButtonElement);
  const panel = createPanel("photo", { onShow: (on) => (on ? begin() : setView(FIELD_OF_VIEW)) });
  /** @type {Size[]} */
  let sizes = [];

  /** @param {number} degrees */
  function setView(degrees) {
    view.value = String(degrees);
    said.textContent = `${degrees}°`;
    const { scene } = viewer;
    if (!scene || (scene.walker.fieldOfView ?? FIELD_OF_VIEW) === degrees) return;
    scene.walker.fieldOfView = degrees;
    onView();
    viewer.redraw();
  }

  function listSizes() {
    const { scene, gl } = viewer, chosen = Math.max(0, size.selectedIndex);
    if (!scene) return;
    const longest = Math.min(gl.getParameter(gl.MAX_TEXTURE_SIZE), ...gl.getParameter(gl.MAX_VIEWPORT_DIMS));
    sizes = photoSizes(viewer.camera(scene), longest);
    size.replaceChildren(...sizes.map(({ width, height }) =>
      new Option(`${width} × ${height} (${Number((width / sizes[0].width).toFixed(1))}×)`)));
    size.selectedIndex = Math.min(chosen, sizes.length - 1);
  }

  function begin() {
    listSizes();
    setView(FIELD_OF_VIEW);
  }

  const save = () => jobs.run("Drawing the photo", (signal, tell) =>
    capturing(viewer, { ...sizes[size.selectedIndex], signal }, async (capture) => {
      const { scene } = viewer;
      if (!scene) return;
      const canvas = await capture({ ...scene.walker }, BUDGET.most, tell);
      /** @type {Blob | null} */
      const blob = await new Promise((done) => canvas.toBlob(done));
      if (!blob) throw new Error("the photo cannot be saved");
      saveFile(blob, ".png");
      viewer.hud.say("The photo is saved.");
    }));

  view.addEventListener("input", () => setView(Number(view.value)));
  take.addEventListener("click", save);
  new ResizeObserver(listSizes).observe(viewer.canvas);
  addEventListener("keydown", (event) => {
    if (event.code !== "KeyF" || event.ctrlKey || event.metaKey || event.altKey || takesLetters(event.target)) return;
    panel.show(!panel.open);
  });
  return panel;
}
