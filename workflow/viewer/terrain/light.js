// Light of the place: ground and sky as the sun moves. Colours of Gaussians contain the light of level ground below the
// captured sun; they are multiplied by the ratio of their own light to it, in linear light.
// The same numbers as dav_gswt/terrain/light.py; tests/golden/light.json holds both to it.

import { createShadows } from "./shadows.js";
import { findHour, luminance, measureLight, placeSun, sunAt } from "./sun.js";

/**
 * A manifest's `light`: the captured sun, and where it is known from.
 * @typedef {{ elevation: number, azimuth: number, source: string, north?: number }} LightEntry
 * @typedef {import("./sun.js").Sun & { hour: number }} DaySun
 *
 * direct: sunlight on ground that faces the sun; ambient: skylight on level ground; both relative to the captured light
 * of level ground. level: factor of the sRGB colours of open, level ground. Other colours are sRGB. shadows: null: not
 * made yet.
 * @typedef {{ sun: DaySun, direct: number[], ambient: number[], level: number[], zenith: number[], horizon: number[],
 *   ground: number[], sunColour: number[], shadows: import("./shadows.js").Shadows | null }} Lighting
 * @typedef {NonNullable<ReturnType<typeof createLight>>} Light
 *
 * An hour of the day, null for the captured sun, or no light: colours as captured.
 * @typedef {number | null | "off"} ChosenSun
 */

export const GAMMA = 2.2; // exponent that stands for the curve of sRGB
export const MOST = 4; // times the captured light, of any ground
const EXPOSED = 0.7; // share of a change of brightness, in stops, that the exposure makes up for
const HAZE = 0.1; // share of the sun's beam in the light of the horizon
const TURN = 8; // milliseconds of work on shadows between which others have a turn

/** Multiply sRGB colours in linear light. @param {number[]} colour @param {number[]} ratio */
const relight = (colour, ratio) => colour.map((v, k) => Math.min(Math.max(v * ratio[k] ** (1 / GAMMA), 0), 1));

/**
 * The light below a sun, without its shadows.
 *
 * @param {Pick<import("../data/manifest.js").Manifest, "sky" | "ground_colour">} manifest
 * @param {import("./sun.js").Sun} captured @param {DaySun} sun
 * @returns {Omit<Lighting, "shadows">}
 */
export function lightBelow({ sky, ground_colour: ground }, captured, sun) {
  const before = measureLight(captured.elevation), now = measureLight(sun.elevation);
  const exposure = (luminance(before.level) / luminance(now.level)) ** EXPOSED;
  const direct = now.direct.map((v, k) => (exposure * v) / before.level[k]);
  const ambient = now.sky.map((v, k) => (exposure * v) / before.level[k]);
  const level = direct.map((v, k) => Math.min(v * Math.max(sun.direction[2], 0) + ambient[k], MOST));
  const above = now.sky.map((v, k) => (exposure * v) / before.sky[k]);
  const [hazeBefore, hazeNow] = [before, now].map((one) => one.sky.map((v, k) => v + HAZE * one.direct[k]));
  const haze = hazeNow.map((v, k) => (exposure * v) / hazeBefore[k]);
  /** No brighter than it was captured. @param {number[]} ratio */
  const dim = (ratio) => ratio.map((v) => v / Math.max(luminance(ratio), 1));
  const brightest = Math.max(...now.direct);
  return {
    sun, direct, ambient, level: level.map((v) => v ** (1 / GAMMA)), zenith: relight(sky.zenith, dim(above)),
    horizon: relight(sky.horizon, dim(haze)), ground: relight(ground, level),
    sunColour: now.direct.map((v) => (v / brightest) ** (1 / GAMMA)),
  };
}

/**
 * The light of a terrain, at first as captured; null where the captured sun is not known, and on a planet.
 *
 * @param {import("../data/manifest.js").Manifest} manifest @param {import("./heights.js").HeightField} heights
 */
export function createLight(manifest, heights) {
  if (!manifest.light || heights.kind === "sphere") return null;
  const { elevation, azimuth, north = 0 } = manifest.light, captured = placeSun(elevation, azimuth);
  const capturedHour = findHour(captured, north);
  const shadows = heights.kind === "flat" ? null : createShadows(heights, manifest.tile_side);
  /** @type {ChosenSun} */
  let chosen = null;
  /** @type {Omit<Lighting, "shadows"> | null} */
  let below = null;

  /** @param {ChosenSun} sun */
  function choose(sun) {
    const placed = typeof sun === "number" ? sunAt(captured, sun, north) : { ...captured, hour: capturedHour };
    chosen = typeof sun === "number" ? placed.hour : sun;
    below = sun === "off" ? null : lightBelow(manifest, captured, placed);
  }
  choose(null);

  const light = {
    choose,
    capturedHour,
    north,
    get chosen() {
      return chosen;
    },
    /** What is drawn now; null: colours as captured. @returns {Lighting | null} */
    get now() {
      return below && { ...below, shadows: shadows?.made ?? null };
    },
    /**
     * Work on shadows for some milliseconds. Returns: are those that an eye sees whole?
     *
     * @param {number[]} eye @param {number} milliseconds
     */
    step: ([x, y], milliseconds) => !below || !shadows || shadows.step(x, y, below.sun, milliseconds),
    /** Make the shadows that an eye sees. @param {number[]} eye */
    async finish(eye) {
      while (!light.step(eye, TURN)) await new Promise((done) => setTimeout(done));
    },
  };
  return light;
}
