// Sharing a place: its address, by the device's own way where there is one, else on the clipboard.

import { replaceAddress } from "./address.js";

const TOO_LONG = "What is painted is too much for a link. Save it as a file.";

/**
 * @param {import("./viewer.js").Viewer} viewer
 * @param {Pick<import("./paint_keep.js").PaintKeep, "findLink">} paint
 */
export async function sharePlace(viewer, paint) {
  const link = await paint.findLink();
  if (link === null) return viewer.hud.say(TOO_LONG);
  const address = new URL(location.href);
  address.hash = viewer.address(link);
  replaceAddress(address.hash);
  try {
    if (document.documentElement.classList.contains("touch") && navigator.share) {
      await navigator.share({ title: document.title, url: address.href });
      return;
    }
    await navigator.clipboard.writeText(address.href);
    viewer.hud.say("The link to this place is copied.");
  } catch (error) {
    const { name } = /** @type {Error} */ (error);
    if (name !== "AbortError") viewer.hud.say("The link to this place is in the address bar."); // else: thought better of it
  }
}
