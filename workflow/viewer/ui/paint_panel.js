// The panel of materials: brushes, history, densities of objects, links and files.

import { DENSITY_STEPS, MAX_DENSITY } from "../data/paint.js";
import { MAX_PAINTED } from "../terrain/painted.js";
import { createPanel, cssColour, element, isField, swatch } from "./dom.js";
import { createBrush, ERASER, SIZES } from "./paint_brush.js";
import { createPaintKeep, readPaintFile } from "./painting.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {import("./painting.js").Painting} Painting
 */

const TROUBLES = {
  sky: "There is no ground under the brush.", far: "So far from the origin nothing can be painted.",
  full: `No more can be painted: ${MAX_PAINTED.toLocaleString("en")} places is the most. Erase some.`,
};
const LOOK = "look"; // value of the choice that paints nothing
const TOO_LONG = "This is too much for a link. Save it as a file.";

/** @param {Viewer} viewer */
export function createPaintPanel(viewer) {
  const toggle = element("paintButton", HTMLButtonElement);
  const panel = createPanel("paint", { onShow: (on) => (on ? drawObjects() : choose(LOOK)), closesOnEscape: false });
  const brushes = element("brushes", HTMLFieldSetElement), status = element("paintStatus", HTMLElement);
  const [undo, redo, clear, save, open] = ["undo", "redo", "clear", "savePaint", "openPaint"]
    .map((id) => element(id, HTMLButtonElement));
  const file = element("paintFile", HTMLInputElement), size = element("brushSize", HTMLInputElement);
  const brush = createBrush(viewer, (trouble) => say(trouble ? TROUBLES[trouble] : ""));
  const keep = createPaintKeep(viewer, (tooLong) => tooLong && say(TOO_LONG));
  /** @type {(() => void)[]} */
  let refreshers = []; // of sliders
  let drawn = false; // are the small pictures of objects, or will they be?
  Object.assign(size, { min: SIZES.least, max: SIZES.most, step: 0.1, value: SIZES.first });

  /** @param {string} text */
  function say(text) {
    if (status.textContent !== text) status.textContent = text;
  }

  /** @param {string} value of a brush */
  function choose(value) {
    const radio = brushes.querySelector(`input[value="${value}"]`);
    if (!(radio instanceof HTMLInputElement)) return;
    radio.checked = true;
    brush.material = value === LOOK ? null : Number(value);
    document.documentElement.classList.toggle("painting", brush.material !== null);
    brush.draw();
  }

  /** @param {string} value @param {string} name @param {string} key @param {number[] | null} colour */
  function addBrush(value, name, key, colour) {
    const label = document.createElement("label"), radio = document.createElement("input");
    Object.assign(radio, { type: "radio", name: "brush", value });
    radio.addEventListener("change", () => choose(value));
    label.append(radio, ...colour ? [swatch(cssColour(colour))] : [], name);
    label.title = `${name} (${key})`;
    brushes.append(label);
  }

  /** Once, when the panel is first open and the terrain is read. */
  async function drawObjects() {
    const { scene } = viewer;
    if (drawn || !panel.open || !viewer.loaded || !scene) return;
    drawn = true;
    const canvases = [...element("densities", HTMLElement).querySelectorAll("canvas")];
    try {
      if (canvases.length) await (await import("./thumbnails.js")).drawThumbnails(scene, canvases);
    } catch (error) {
      console.error(error); // the sliders work without pictures
    }
  }

  function update() {
    const { painting } = viewer.scene ?? {};
    undo.disabled = !painting?.canUndo;
    redo.disabled = !painting?.canRedo;
    for (const refresh of refreshers) refresh();
  }

  /** @param {() => unknown} act */
  const guarded = (act) => async () => {
    try {
      await act();
    } catch (error) {
      viewer.fail(error);
    }
  };
  const take = () => viewer.scene?.painting.undo(), again = () => viewer.scene?.painting.redo();

  undo.addEventListener("click", take);
  redo.addEventListener("click", again);
  clear.addEventListener("click", () => viewer.scene?.painting.load(viewer.scene.painting.blank));
  save.addEventListener("click", () => keep.save());
  open.addEventListener("click", () => file.click());
  file.addEventListener("change", guarded(async () => {
    const chosen = file.files?.[0];
    if (chosen) keep.load(await readPaintFile(chosen).finally(() => (file.value = "")));
  }));
  size.addEventListener("input", () => {
    brush.radius = Number(size.value);
    brush.draw();
  });
  addEventListener("keydown", (event) => {
    if (toggle.hidden || event.altKey) return;
    if (event.ctrlKey || event.metaKey) {
      const letter = /^[a-z]$/i.test(event.key) ? event.key.toLowerCase() : event.code.slice(3).toLowerCase(); // layouts exchange Z and Y
      const redoes = letter === "y" || (letter === "z" && event.shiftKey);
      if (!redoes && letter !== "z") return;
      event.preventDefault();
      return redoes ? again() : take();
    }
    if (event.code === "KeyM" && event.target !== element("overlay", HTMLSelectElement)) panel.show(!panel.open);
    if (!panel.open || (isField(event.target) && event.code !== "Escape")) return;
    if (event.code === "Escape") {
      if (event.defaultPrevented) return;
      event.preventDefault();
      if (brush.material === null) panel.show(false);
      else choose(LOOK);
    } else if (event.code === "KeyX") choose(String(ERASER));
    else if (/^Digit[1-8]$/.test(event.code)) choose(String(Number(event.code[5]) - 1));
  });

  return {
    brush,
    keep,
    drawObjects,
    /** Something was painted, set, or taken back. */
    note() {
      keep.note();
      update();
    },
    /** A terrain was opened. @param {import("./viewer.js").Scene} scene */
    showScene({ manifest, painting }) {
      const { materials, objects = [] } = manifest;
      toggle.hidden = materials.length < 2 && !objects.length;
      keep.reset();
      panel.show(false);
      say("");
      brushes.replaceChildren(brushes.children[0]);
      addBrush(LOOK, "look around", "Esc", null);
      for (const [m, { name, ground_colour: colour }] of materials.entries()) addBrush(String(m), name, String(m + 1), colour);
      addBrush(String(ERASER), "eraser", "X", null);
      choose(LOOK);
      element("brushBox", HTMLElement).hidden = materials.length < 2;
      const box = element("densities", HTMLElement);
      element("densityBox", HTMLElement).hidden = !objects.length;
      box.replaceChildren();
      drawn = false;
      refreshers = objects.map(({ name, material }, k) => {
        const on = materials.length > 1 ? ` on ${materials[material].name}` : "";
        return addDensity(box, titleOf(name) + on, painting, k);
      });
      update();
    },
  };
}

/** A name to read: object07 becomes Object 7. @param {string} name */
const titleOf = (name) => `${name[0].toUpperCase()}${name.slice(1).replace(/(\D)0*(\d+)$/, "$1 $2")}`;

/**
 * Switch, small picture and density of an object. Returns: a function that brings them up to date.
 *
 * @param {HTMLElement} box @param {string} name @param {Painting} painting @param {number} object
 */
function addDensity(box, name, painting, object) {
  const row = document.createElement("div"), label = document.createElement("label"), step = 1 / DENSITY_STEPS;
  const on = document.createElement("input"), title = document.createElement("span");
  const input = document.createElement("input"), output = document.createElement("output");
  let last = 1; // the last density at which it was shown
  Object.assign(on, { type: "checkbox", title: "Show this object" });
  Object.assign(input, { type: "range", min: 0, max: MAX_DENSITY, step });
  input.setAttribute("aria-label", `Density of ${name}`);
  [title.textContent, title.className, row.className] = [name, "name", "density"];
  label.append(on, document.createElement("canvas"), title);
  row.append(label, input, output);
  box.append(row);
  on.addEventListener("change", () => painting.setDensity(object, on.checked ? last : 0, true));
  for (const kind of ["input", "change"]) { // the second when it is let go
    input.addEventListener(kind, () => painting.setDensity(object, Number(input.value), kind === "change"));
  }
  return () => {
    const value = painting.densities[object];
    on.checked = value > 0;
    if (value > 0) last = value;
    output.textContent = `${value.toFixed(2)}×`;
    if (document.activeElement !== input || Math.abs(Number(input.value) - value) > step) input.value = String(value);
  };
}
