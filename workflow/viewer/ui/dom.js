// Elements of the page, and files that a person keeps.

/**
 * An element of index.html. Throws: there is none of this id and type.
 *
 * @template {Element} T
 * @param {string} id
 * @param {new () => T} type
 * @returns {T}
 */
export function element(id, type) {
  const found = document.getElementById(id);
  if (!(found instanceof type)) throw new TypeError(`index.html has no ${type.name} of id ${id}`);
  return found;
}

/** Is this where keys enter or choose something? @param {EventTarget | null} target */
export const isField = (target) => target instanceof HTMLInputElement || target instanceof HTMLSelectElement
  || target instanceof HTMLButtonElement || (target instanceof HTMLElement && (target.tagName === "SUMMARY" || target.role === "slider"));

/** Do letters mean something to this itself, so that they are no commands? @param {EventTarget | null} target */
export const takesLetters = (target) => target instanceof HTMLSelectElement;

/** A patch of a colour, 0 to 1. @param {number[]} colour */
export function swatch(colour) {
  const patch = document.createElement("i");
  patch.className = "swatch";
  patch.style.backgroundColor = `rgb(${colour.map((v) => Math.round(255 * v)).join(" ")})`;
  return patch;
}

/**
 * Let a person keep a blob as a file that has the scene's name.
 *
 * @param {Blob} blob
 * @param {string} ending of the file's name
 */
export function saveFile(blob, ending) {
  const link = document.createElement("a"), title = element("name", HTMLElement).textContent ?? "";
  link.href = URL.createObjectURL(blob);
  link.download = `${title.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "") || "terrain"}${ending}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
