// Elements of the page: keys, panels, and files that a person keeps.

/**
 * An element of index.html. Throws if there is none of this id and type.
 *
 * @template {Element} T
 * @param {string} id @param {new () => T} type
 * @returns {T}
 */
export function element(id, type) {
  const found = document.getElementById(id);
  if (!(found instanceof type)) throw new TypeError(`index.html has no ${type.name} of id ${id}`);
  return found;
}

/** Is this where keys enter or choose something? @param {EventTarget | null} target */
export const isField = (target) => target instanceof HTMLInputElement || target instanceof HTMLSelectElement
  || target instanceof HTMLButtonElement || (target instanceof HTMLElement && target.tagName === "SUMMARY");

/** Run commands when their keys are pressed, outside of lists. @param {Record<string, () => void>} commands by code */
export function listenToKeys(commands) {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target instanceof HTMLSelectElement) return;
    commands[event.code]?.();
  });
}

/** A colour, 0 to 1, in CSS. @param {number[]} colour @param {number} [most] */
export const cssColour = (colour, most = 255) => `rgb(${colour.map((v) => Math.round(most * v)).join(" ")})`;

/** A patch of a colour in CSS. @param {string} colour */
export function swatch(colour) {
  const patch = document.createElement("i");
  patch.className = "swatch";
  patch.style.backgroundColor = colour;
  return patch;
}

/** Save a blob as a file that has the scene's name. @param {Blob} blob @param {string} ending of the file's name */
export function saveFile(blob, ending) {
  const link = document.createElement("a"), title = element("name", HTMLElement).textContent ?? "";
  link.href = URL.createObjectURL(blob);
  link.download = `${title.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "") || "terrain"}${ending}`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/**
 * A panel that its buttons open and close. Escape closes it, and the keyboard's focus goes in and
 * comes back.
 *
 * @param {string} id of the panel; its buttons are `<id>Button` and `<id>Close`
 * @param {{ onShow?: (on: boolean) => void, closesOnEscape?: boolean }} [options]
 */
export function createPanel(id, { onShow = () => {}, closesOnEscape = true } = {}) {
  const panel = element(id, HTMLElement), button = element(`${id}Button`, HTMLButtonElement);
  /** @param {boolean} on */
  const show = (on) => {
    if (on !== Boolean(panel.hidden)) return;
    const inside = panel.contains(document.activeElement);
    panel.hidden = !on;
    button.setAttribute("aria-expanded", String(on));
    if (on) panel.focus();
    else if (inside && button.offsetParent) button.focus();
    onShow(on);
  };
  button.addEventListener("click", () => show(Boolean(panel.hidden)));
  element(`${id}Close`, HTMLButtonElement).addEventListener("click", () => show(false));
  panel.addEventListener("keydown", (event) => {
    if (!closesOnEscape || event.code !== "Escape") return;
    event.preventDefault(); // one thing at a time
    show(false);
  });
  return {
    show,
    get open() {
      return !panel.hidden;
    },
  };
}
