// How this was made: a plan of the photos over the ground, the rounds, and the photos themselves; read when asked for.

import { isNatural, PageError } from "../data/checks.js";
import { webSource } from "../data/source.js";
import { createPanel, element, swatch } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg", SIZE = 240, MARGIN = 16;
const ROUNDS = ["#e3b778", "#7fc4e8", "#8fd18a", "#e79bc0", "#d8d06a", "#b7a6f0"]; // colours, from the start on
const STORY = "story.json", SHEET = "photos.jpg";
const MOST = 10_000; // photos

/**
 * at: place seen from the middle of the ground; look: direction on the ground; picture: number in the sheet.
 * @typedef {{ round: number, at: number[], look: number[], picture?: number }} StoryPhoto
 *
 * psnr: of the terrain's own fit; null where no photo tested it, or another preset's fit was tested.
 * @typedef {{ photos: number, psnr: number | null }} StoryRound
 *
 * half: half the side of the ground that tiles are cut from; thumb: pixels along a side of a photo in the sheet.
 * @typedef {{ unit: string, half: number, photos: StoryPhoto[], rounds: StoryRound[],
 *   thumb: number, columns: number, pictures: number }} Story
 */

const COMPASS = ["north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west"];
/** @type {Record<string, string>} */
const SOURCES = {
  config: "as the settings say", exif: "as the places and times of the photos tell",
  relief: "judged by the shading of the ground", assumed: "which is assumed: the photos do not tell",
};

/**
 * @param {() => import("../terrain/light.js").LightEntry | undefined} findLight
 * @param {(error: unknown) => void} onError
 */
export function createStoryPanel(findLight, onError) {
  const body = element("storyBody", HTMLElement);
  return createPanel("story", {
    onShow(on) {
      if (!on || body.firstChild) return;
      readOwnStory().then((story) => body.replaceChildren(...describe(story), ...describeLight(findLight())), onError);
    },
  });
}

async function readOwnStory() {
  const bytes = await webSource(new URL(".", location.href)).read(STORY, null);
  return readStory(JSON.parse(new TextDecoder().decode(bytes)));
}

/** @param {Story} story */
function describe(story) {
  const { photos, rounds } = story, tested = rounds.filter(({ psnr }) => psnr !== null);
  const text = document.createElement("p");
  text.textContent = `${photos.length} photos became a field of Gaussians, the field tiles, and the tiles this terrain. `
    + `${rounds.length > 1 ? `After the first, ${rounds.length - 1} times further photos were asked for. ` : ""}`
    + `${tested.length ? "PSNR, in decibels, says how well photos that were not used are predicted: more is better." : ""}`;
  return [drawPlan(story), listRounds(story), text, showPhotos(story)];
}

/** Which sun the colours contain, and what stays. @param {import("../terrain/light.js").LightEntry} [light] */
function describeLight(light) {
  if (!light) return [];
  const { elevation, azimuth, source, north = 0 } = light, text = document.createElement("p");
  text.textContent = `The photos show light of a sun ${Math.round(elevation)}° high in the `
    + `${COMPASS[Math.round((azimuth + north) / 45) % COMPASS.length]}, ${SOURCES[source]}. `
    + "The time of day changes sky, hills and their shadows; ripples, stones and the shade on objects stay.";
  return [text];
}

/** @param {string} name @param {Record<string, string | number>} attributes */
function draw(name, attributes) {
  const shape = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) shape.setAttribute(key, String(value));
  return shape;
}

/** The ground from above, north up, with cameras and where they look. @param {Story} story */
function drawPlan({ photos, half }) {
  const reach = Math.max(half, ...photos.map(({ at }) => Math.max(Math.abs(at[0]), Math.abs(at[1]))));
  const scale = (SIZE / 2 - MARGIN) / reach, side = 2 * half * scale;
  const svg = draw("svg", { viewBox: `0 0 ${SIZE} ${SIZE}`, role: "img", "aria-label": "Places of the photos over the ground" });
  svg.append(draw("rect", { x: (SIZE - side) / 2, y: (SIZE - side) / 2, width: side, height: side, fill: "#6b5b40" }));
  for (const { at, look, round } of photos) {
    const x = SIZE / 2 + scale * at[0], y = SIZE / 2 - scale * at[1], colour = ROUNDS[round % ROUNDS.length];
    svg.append(
      draw("line", { x1: x, y1: y, x2: x + 12 * look[0], y2: y - 12 * look[1], stroke: colour, "stroke-width": 2 }),
      draw("circle", { cx: x, cy: y, r: 4, fill: colour }));
  }
  return svg;
}

/** @param {Story} story */
function listRounds({ rounds }) {
  const table = document.createElement("table");
  table.createTHead().innerHTML = "<tr><th></th><th>photos</th><th>PSNR</th></tr>";
  const rows = table.createTBody();
  for (const [k, { photos, psnr }] of rounds.entries()) {
    const row = rows.insertRow();
    row.insertCell().append(swatch(ROUNDS[k % ROUNDS.length]), k ? ` round ${k}` : " start");
    row.insertCell().append(k ? `+ ${photos}` : String(photos));
    row.insertCell().append(psnr === null ? "" : `${psnr.toFixed(1)} dB`);
  }
  return table;
}

/** @param {Story} story */
function showPhotos({ photos, thumb, columns }) {
  const list = document.createElement("div");
  list.className = "photos";
  for (const { picture, round } of photos) {
    if (picture === undefined) continue;
    const photo = document.createElement("div"), [column, row] = [picture % columns, Math.floor(picture / columns)];
    photo.setAttribute("role", "img");
    photo.setAttribute("aria-label", round ? `Photo of round ${round}` : "Photo of the start");
    Object.assign(photo.style, {
      width: `${thumb}px`, height: `${thumb}px`, backgroundImage: `url("${SHEET}")`,
      backgroundPosition: `${-column * thumb}px ${-row * thumb}px`, borderColor: ROUNDS[round % ROUNDS.length],
    });
    list.append(photo);
  }
  return list;
}

/** story.json, checked. Throws a PageError. @param {any} value parsed JSON @returns {Story} */
export function readStory(value) {
  const finite = (/** @type {any} */ v) => Array.isArray(v) && v.every(Number.isFinite);
  const { unit, half, photos, rounds, thumb, columns, pictures } = value ?? {};
  const sound = typeof unit === "string" && unit.length <= 40 && half > 0 && Number.isFinite(half)
    && [thumb, columns, pictures].every(isNatural) && thumb > 0 && thumb <= 512 && columns > 0 && columns <= 64
    && Array.isArray(photos) && photos.length <= MOST && Array.isArray(rounds) && rounds.length <= MOST
    && photos.every((one) => isNatural(one?.round) && finite(one.at) && one.at.length === 3 && finite(one.look)
      && one.look.length === 2 && (one.picture === undefined || (isNatural(one.picture) && one.picture < pictures)))
    && rounds.every((one) => isNatural(one?.photos) && (one.psnr === null || Number.isFinite(one.psnr)));
  if (!sound) throw new PageError(`${STORY} is not as the workflow writes it. Make the page again.`);
  return { unit, half, photos, rounds, thumb, columns, pictures };
}
