// Files dropped onto the page: a bundle's folder, its zip, a gswt.zip for the public renderer, or a fly path.

import { NAME } from "./bundle.js";
import { gswtSource, isGswt } from "./gswt.js";
import { fromFiles, PageError } from "./source.js";
import { readZip } from "./zip.js";

export function listenToDrops(document, { open, flight, fail }) {
  const over = (on) => document.documentElement.classList.toggle("dropping", on);
  addEventListener("dragover", (event) => {
    event.preventDefault();
    over(true);
  });
  addEventListener("dragleave", () => over(false));
  addEventListener("drop", (event) => {
    event.preventDefault();
    over(false);
    // entries must be asked for before anything is awaited: the browser forgets them
    const entries = [...event.dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter((entry) => entry);
    const files = [...event.dataTransfer.files];
    taken(entries, files, { open, flight }).catch(fail);
  });
}

async function taken(entries, loose, { open, flight }) {
  const files = entries.length ? await listed(entries) : new Map(loose.map((file) => [file.name, file]));
  const only = files.size === 1 ? [...files.values()][0] : null;
  if (only && /\.json$/i.test(only.name) && only.name !== NAME) return flight(await flightOf(only));
  if (only && /\.zip$/i.test(only.name)) return open(await sourceOf(await readZip(only)));
  const readers = new Map([...files].map(([name, file]) => [name, () => file.arrayBuffer()]));
  return open(await sourceOf(readers));
}

/** A bundle, wherever its manifest lies among the files, or a set of tiles for the public renderer. */
export async function sourceOf(files) {
  const manifest = [...files.keys()].filter((name) => name === NAME || name.endsWith(`/${NAME}`))
    .sort((a, b) => a.length - b.length)[0];
  if (manifest !== undefined) {
    const above = manifest.slice(0, -NAME.length);
    const inside = [...files].filter(([name]) => name.startsWith(above));
    return fromFiles(new Map(inside.map(([name, open]) => [name.slice(above.length), open])));
  }
  if (isGswt(files)) return gswtSource(files);
  throw new PageError(
    `There is no terrain in what was dropped: neither ${NAME} nor lod0_tile_00.ply. `
    + "Drop a bundle's folder or its gswt.zip.");
}

async function flightOf(file) {
  try {
    return JSON.parse(await file.text());
  } catch (error) {
    throw new PageError(
      `${file.name} is not readable as JSON (${error.message}). Drop a fly path that this page saved.`);
  }
}

/** All files of dropped entries, folders included, by their paths. */
async function listed(entries) {
  const files = new Map();
  const walk = async (entry) => {
    if (entry.isFile) files.set(entry.fullPath.replace(/^\//, ""), await new Promise((y, n) => entry.file(y, n)));
    else {
      const reader = entry.createReader();
      for (;;) {
        const some = await new Promise((y, n) => reader.readEntries(y, n));
        if (!some.length) break;
        for (const one of some) await walk(one);
      }
    }
  };
  for (const entry of entries) await walk(entry);
  return files;
}
