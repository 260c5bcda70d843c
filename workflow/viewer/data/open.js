// Where a terrain comes from: a folder of the web, a zip, or files by name.

import { PageError } from "./errors.js";
import { gswtSource, isGswt } from "./gswt.js";
import { NAME } from "./manifest.js";
import { fileSource, webSource } from "./source.js";
import { openZip } from "./zip.js";

/**
 * @typedef {import("./source.js").Source} Source
 * @typedef {import("./source.js").Files} Files
 */

/**
 * The source of a terrain: the address of its folder, the folder's files (paths as a directory picker gives them), or
 * its zip. Throws a PageError.
 *
 * @param {string | URL | Blob | Iterable<File>} where
 * @returns {Promise<Source>}
 */
export async function openSource(where) {
  if (typeof where === "string" || where instanceof URL) return webSource(folderOf(where));
  if (where instanceof Blob) return sourceOf(await openZip(where));
  return sourceOf(filesOf(new Map([...where].map((file) => [file.webkitRelativePath || file.name, file]))));
}

/** The address of a folder or of the manifest in it, against the page's own. @param {string | URL} where */
function folderOf(where) {
  const address = new URL(where, globalThis.document?.baseURI ?? globalThis.location?.href);
  if (!address.pathname.endsWith("/") && !address.pathname.endsWith(`/${NAME}`)) address.pathname += "/";
  return new URL(".", address);
}

/** @param {Map<string, Blob>} files @returns {Files} */
export const filesOf = (files) =>
  new Map([...files].map(([name, file]) => [name, { size: file.size, open: () => file.arrayBuffer() }]));

/**
 * A bundle, wherever its manifest lies among the files, or a set of tiles for the public renderer.
 *
 * @param {Files} files
 * @returns {Promise<Source>}
 */
export async function sourceOf(files) {
  const manifest = [...files.keys()].filter((name) => name === NAME || name.endsWith(`/${NAME}`))
    .sort((a, b) => a.length - b.length)[0];
  if (manifest !== undefined) {
    const above = manifest.slice(0, -NAME.length);
    const inside = [...files].filter(([name]) => name.startsWith(above));
    return fileSource(new Map(inside.map(([name, entry]) => [name.slice(above.length), entry])));
  }
  if (isGswt(files)) return gswtSource(files);
  throw new PageError(
    `There is no terrain in what was dropped: neither ${NAME} nor lod0_tile_00.ply. `
    + "Drop a bundle's folder or its gswt.zip.");
}
