// The pace that a device was found to hold, kept by its browser, so that the next visit begins with it.

import { BUDGET, LEAST_SCALE } from "../draw/frame_pacing.js";

/** @typedef {import("../draw/frame_pacing.js").Pace} Pace */

const KEY = "davgswt.pace", VERSION = 1;
const LONGEST = 1000; // characters of what is kept
const EVERY = 2000; // milliseconds between updates

/**
 * The kept pace, within its bounds; null: none that is sound, or of another graphics device.
 *
 * @param {string | null} text as `describePace` made it
 * @param {string} device
 * @returns {Pace | null}
 */
export function readPace(text, device) {
  if (!text || text.length > LONGEST) return null;
  try {
    const { version, device: found, budget, scale } = JSON.parse(text);
    if (version !== VERSION || found !== device || !Number.isFinite(budget) || !Number.isFinite(scale)) return null;
    return {
      budget: Math.min(Math.max(Math.round(budget), BUDGET.least), BUDGET.most),
      scale: Math.min(Math.max(scale, LEAST_SCALE), 1),
    };
  } catch {
    return null;
  }
}

/** @param {Pace} pace @param {string} device */
export const describePace = ({ budget, scale }, device) =>
  JSON.stringify({ version: VERSION, device, budget: Math.round(budget), scale: Number(scale.toFixed(3)) });

/**
 * Begin with the kept pace, and keep what frames say of it from now on. Returns: was one kept?
 *
 * @param {import("../draw/gl.js").GL} gl
 * @param {import("../draw/frame_pacing.js").FramePacing} pacing
 */
export function keepPace(gl, pacing) {
  const device = nameDevice(gl), kept = readPace(attempt(() => localStorage.getItem(KEY)), device);
  if (kept) pacing.resume(kept);
  let last = describePace(pacing, device);
  const write = () => {
    const now = describePace(pacing, device);
    if (!pacing.fps || now === last) return; // nothing was measured yet, or nothing new
    last = now;
    attempt(() => localStorage.setItem(KEY, now));
  };
  setInterval(write, EVERY);
  addEventListener("pagehide", write);
  return kept !== null;
}

/** The graphics device's name, cut to a length that is kept. @param {import("../draw/gl.js").GL} gl */
function nameDevice(gl) {
  const more = gl.getExtension("WEBGL_debug_renderer_info");
  return String(gl.getParameter(more ? more.UNMASKED_RENDERER_WEBGL : gl.RENDERER)).slice(0, LONGEST / 2);
}

/** What the storage says; null: it is full, or people have switched it off. @template T @param {() => T} act */
function attempt(act) {
  try {
    return act();
  } catch {
    return null;
  }
}
