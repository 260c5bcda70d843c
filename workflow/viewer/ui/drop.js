// Files dropped onto the page: a bundle's folder, its zip, a gswt.zip for the public renderer, or a JSON file of
// painted materials.

import { filesOf, openSource as openFiles, sourceOf } from "../data/bundle.js";
import { PageError } from "../data/checks.js";
import { NAME } from "../data/manifest.js";
import { MAX_FILES } from "../data/source.js";
import { readPaintFile } from "./painting.js";

/**
 * @typedef {import("../data/source.js").Source} Source
 * @typedef {{ openSource: (source: Source) => Promise<void>, loadJson: (json: unknown) => void,
 *   onError: (error: unknown) => void }} DropHandlers
 */

const MAX_DEPTH = 16; // of folders in folders

/** @param {DropHandlers} handlers */
export function listenToDrops(handlers) {
  /** @param {boolean} on */
  const markDropping = (on) => document.documentElement.classList.toggle("dropping", on);
  addEventListener("dragover", (event) => {
    event.preventDefault();
    markDropping(true);
  });
  addEventListener("dragleave", () => markDropping(false));
  addEventListener("drop", (event) => {
    event.preventDefault();
    markDropping(false);
    // entries must be asked for before anything is awaited: the browser forgets them
    const entries = [...event.dataTransfer?.items ?? []].flatMap((item) => item.webkitGetAsEntry?.() ?? []);
    const files = [...event.dataTransfer?.files ?? []];
    handleDrop(entries, files, handlers).catch(handlers.onError);
  });
}

/** @param {FileSystemEntry[]} entries @param {File[]} loose @param {DropHandlers} handlers */
async function handleDrop(entries, loose, { openSource, loadJson }) {
  const files = entries.length ? await listFiles(entries) : new Map(loose.map((file) => [file.name, file]));
  const only = files.size === 1 ? [...files.values()][0] : null;
  if (only && /\.json$/i.test(only.name) && only.name !== NAME) return loadJson(await readPaintFile(only));
  if (only && /\.zip$/i.test(only.name)) return openSource(await openFiles(only));
  return openSource(await sourceOf(filesOf(files)));
}

/** All files of dropped entries and folders, by path. @param {FileSystemEntry[]} entries */
async function listFiles(entries) {
  /** @type {Map<string, File>} */
  const files = new Map();
  /** @param {FileSystemEntry} entry @param {number} depth */
  const walk = async (entry, depth) => {
    if (files.size >= MAX_FILES || depth > MAX_DEPTH) {
      throw new PageError(`More than ${MAX_FILES} files were dropped, or folders deep in folders. Drop the bundle's alone.`);
    }
    if (entry.isFile) {
      const { file } = /** @type {FileSystemFileEntry} */ (entry);
      files.set(entry.fullPath.replace(/^\//, ""), await new Promise((done, fail) => file.call(entry, done, fail)));
      return;
    }
    const reader = /** @type {FileSystemDirectoryEntry} */ (entry).createReader();
    for (;;) { // a reader gives some entries at a time
      /** @type {FileSystemEntry[]} */
      const some = await new Promise((done, fail) => reader.readEntries(done, fail));
      if (!some.length) break;
      for (const one of some) await walk(one, depth + 1);
    }
  };
  for (const entry of entries) await walk(entry, 0);
  return files;
}
