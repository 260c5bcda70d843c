// Checks of values from files, and the error that a person at the screen is told.

import { FARTHEST } from "./layout.js";

/** What went wrong and what to do, in words for the person at the screen. */
export class PageError extends Error {}

export const REMAKE = "Make the page again with “make run”.";
export const REMAKE_SET = "Make the set again.";

const SHORTEST = 1e-9; // of lengths

/** A value in a message. @param {any} value */
export const brief = (value) => String(typeof value === "object" ? typeof value : value).slice(0, 80);
/** @param {any} x */
export const isNatural = (x) => Number.isInteger(x) && x >= 0;
/** @param {any} x */
export const isSalt = (x) => isNatural(x) && x <= 0xffffffff;
/** @param {any} x */
export const isLength = (x) => Number.isFinite(x) && x >= SHORTEST && x <= FARTHEST;
/** @param {any} x */
export const isCoordinate = (x) => Number.isFinite(x) && Math.abs(x) <= FARTHEST;
/** @param {any} x */
export const isShare = (x) => Number.isFinite(x) && x >= 0 && x <= 1;
/** @param {any} list */
export const isFilled = (list) => Array.isArray(list) && list.length > 0;
/** @param {any} v */
export const isVector = (v) => Array.isArray(v) && v.length === 3 && v.every(isCoordinate);
/** @param {any} v */
export const isColour = (v) => isVector(v) && v.every(isShare);
/** A unit vector, but for rounding. @param {any} v */
export const isDirection = (v) => isVector(v) && Math.abs(Math.hypot(...v) - 1) < 0.01;
/** A chunk of a set that the page converts itself has no digest. @param {any} text */
export const isDigest = (text) => text === undefined || (typeof text === "string" && /^[0-9a-f]{64}$/i.test(text));
/** A relative path that stays in the bundle. @param {any} file */
export const isInside = (file) => typeof file === "string" && file.length <= 200
  && /^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(file);
/** A number that is no less than 0. @param {any} x */
export const isSize = (x) => isCoordinate(x) && x >= 0;
/** A whole number from `least` to `most`. @param {any} x @param {number} least @param {number} most */
export const isWhole = (x, least, most) => Number.isInteger(x) && x >= least && x <= most;
/** @param {any} name */
export const isName = (name) => typeof name === "string" && name.length > 0 && name.length <= 80;
/** The lowest and the highest of heights. @param {any} z */
export const isRange = (z) => Array.isArray(z) && z.length === 2 && z.every(isCoordinate) && z[0] <= z[1];
/** A list of so many values of a kind. @param {any} list @param {number} size @param {(x: any) => boolean} isKind */
export const isList = (list, size, isKind) => Array.isArray(list) && list.length === size && list.every(isKind);
