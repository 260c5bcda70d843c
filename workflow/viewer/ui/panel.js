// Panels: opened and closed by their buttons; Escape closes, and the keyboard's focus goes in and comes back.

import { element } from "./dom.js";

/** @typedef {ReturnType<typeof createPanel>} Panel */

/**
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
