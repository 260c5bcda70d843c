// The page's address: the place, the overlay, the sun, still air and what is painted:
// `#x,y,eye,yaw,pitch&show=level&sun=14.5&wind=0&paint=...`.

import { OVERLAYS } from "../draw/overlays.js";
import { PLACE_KEYS } from "./walker.js";

/**
 * @typedef {import("../terrain/camera.js").Place} Place
 * @typedef {import("./walker.js").Walker} Walker
 */

const EVERY = 500; // milliseconds between updates of the address

/**
 * The address's part for a walker's place, to a thousandth of the eye floor and of a degree.
 *
 * @param {Walker} walker
 */
function formatPlace(walker) {
  /** @param {number} unit */
  const digits = (unit) => Math.min(15, Math.max(0, Math.ceil(3 - Math.log10(unit))));
  const fine = Math.min(12, digits(walker.floor)), degrees = (180 * walker.floor) / (Math.PI * walker.radius);
  const place = [walker.x, walker.y].map((v) => v.toFixed(walker.radius ? digits(degrees) : fine));
  return `#${[...place, walker.eye.toFixed(fine), walker.yaw.toFixed(3), walker.pitch.toFixed(3)].join(",")}`;
}

/**
 * The place of an address; parts that are missing or no numbers are left out.
 *
 * @param {string} hash
 * @returns {Partial<Place>}
 */
export function parsePlace(hash) {
  const values = decode(hash.replace(/^#/, "")).split("&")[0].split(",").map((v) => (v.trim() === "" ? NaN : Number(v)));
  /** @type {Partial<Place>} */
  const place = {};
  PLACE_KEYS.forEach((key, k) => {
    if (Number.isFinite(values[k])) place[key] = values[k];
  });
  return place;
}

/** The painted part of an address; "": none. @param {string} hash */
export const parsePaint = (hash) => partOf(hash, "paint");

/** The overlay of an address; 0, the terrain as it is, where it names none. @param {string} hash */
export const parseOverlay = (hash) => Math.max(0, OVERLAYS.indexOf(decode(partOf(hash, "show"))));

/** The sun of an address; null: as captured. @param {string} hash @returns {import("../terrain/light.js").ChosenSun} */
export function parseSun(hash) {
  const text = decode(partOf(hash, "sun")).trim(), hour = text === "" ? NaN : Number(text);
  if (text === "off") return text;
  return Number.isFinite(hour) ? hour : null;
}

/** Does the wind blow? @param {string} hash */
export const parseWind = (hash) => partOf(hash, "wind") !== "0";

/** @param {string} hash @param {string} name */
const partOf = (hash, name) => hash.split(`&${name}=`)[1]?.split("&")[0] ?? "";

/**
 * The address's part for a place, what is shown there, the sun, the wind and what is painted.
 *
 * @param {Walker} walker
 * @param {number} overlay 0: the terrain as it is
 * @param {string} paint "": nothing
 * @param {import("../terrain/light.js").ChosenSun} [sun] @param {boolean} [wind]
 */
export function formatAddress(walker, overlay, paint, sun = null, wind = true) {
  const light = sun === null ? "" : `&sun=${typeof sun === "number" ? Number(sun.toFixed(2)) : sun}`;
  return `${formatPlace(walker)}${overlay ? `&show=${OVERLAYS[overlay]}` : ""}${light}${wind ? "" : "&wind=0"}${paint && `&paint=${paint}`}`;
}

/** @param {string} text */
function decode(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text; // a lone % sign
  }
}

let ours = ""; // the address as the page last wrote or followed it

/** Write the page's address without following it. @param {string} hash */
export function replaceAddress(hash) {
  history.replaceState(null, "", hash);
  ours = location.hash;
}

/**
 * Keep the address at the walker's place, and follow an address that a person enters.
 *
 * @param {import("./viewer.js").Viewer} viewer
 * @param {Pick<import("./painting.js").PaintKeep, "link" | "follow">} paint
 */
export function syncAddress(viewer, paint) {
  ours = location.hash;
  const write = () => {
    const hash = viewer.address(paint.link);
    // An address that was just entered differs from ours until its event comes: it must not be overwritten.
    if (hash !== "" && hash !== ours && location.hash === ours) replaceAddress(hash);
  };
  setInterval(write, EVERY);
  addEventListener("pagehide", write);
  addEventListener("hashchange", () => {
    if (location.hash === ours) return;
    ours = location.hash;
    viewer.setPlace(parsePlace(ours));
    viewer.showOverlay(parseOverlay(ours));
    viewer.showSun(parseSun(ours));
    viewer.showWind(parseWind(ours));
    paint.follow(parsePaint(ours)).catch((error) => viewer.fail(error));
  });
}
