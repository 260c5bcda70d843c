// Painted materials that are kept: in the page's address, or as a file.

import { PageError } from "../data/checks.js";
import { decodePaint, describePaint, encodePaint, MAX_FILE, MAX_LINK, readPaint } from "../data/paint.js";
import { saveFile } from "./dom.js";

/**
 * @typedef {import("./viewer.js").Viewer} Viewer
 * @typedef {ReturnType<typeof createPaintKeep>} PaintKeep
 */

const WAIT = 300; // milliseconds from the last change to the new link

/**
 * @param {Viewer} viewer
 * @param {(tooLong: boolean) => void} onLink called when the link has changed
 */
export function createPaintKeep(viewer, onLink) {
  let link = "", timer = 0, changes = 0;

  /** The link of what is painted now; "": as the bundle was made; null: too long. */
  async function findLink() {
    const { scene } = viewer;
    if (!scene) return "";
    const { painting, manifest } = scene, text = await encodePaint(painting.paint, manifest);
    if (text === await encodePaint(painting.blank, manifest)) return "";
    return text.length <= MAX_LINK ? text : null;
  }

  async function updateLink() {
    const change = ++changes, found = await findLink();
    if (change !== changes) return;
    link = found ?? "";
    onLink(found === null);
  }

  return {
    /** The part of the address; "": none. */
    get link() {
      return link;
    },
    findLink,
    /** Something was painted. */
    note() {
      clearTimeout(timer);
      timer = setTimeout(() => updateLink().catch((error) => viewer.fail(error)), WAIT);
    },
    /** A terrain was opened, whose link is not yet known. */
    reset() {
      clearTimeout(timer);
      changes += 1;
      link = "";
    },
    /**
     * Paint what a link holds; "": nothing. Throws a PageError.
     *
     * @param {string} text @param {boolean} [undoable]
     */
    async follow(text, undoable = true) {
      const { scene } = viewer;
      if (!scene || text === link) return;
      const paint = text ? await decodePaint(text, scene.manifest) : scene.painting.blank;
      if (viewer.scene !== scene) return;
      link = text;
      scene.painting.load(paint, undoable);
    },
    save() {
      const { scene } = viewer;
      if (!scene) return;
      const text = JSON.stringify(describePaint(scene.painting.paint, scene.manifest));
      saveFile(new Blob([text], { type: "application/json" }), "-painted.json");
    },
    /** Take a file's JSON. Throws a PageError. @param {unknown} value */
    load(value) {
      const { scene } = viewer;
      if (scene) scene.painting.load(readPaint(value, scene.manifest));
    },
  };
}

/** The JSON of a file that a person has chosen. Throws a PageError. @param {File} file @returns {Promise<unknown>} */
export async function readPaintFile(file) {
  if (file.size > MAX_FILE) throw new PageError(`${file.name} is too large for painted materials.`);
  try {
    return JSON.parse(await file.text());
  } catch {
    throw new PageError(`${file.name} is not readable as JSON. Open a file that “Save” has saved here.`);
  }
}
