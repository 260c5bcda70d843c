// story.json: the photos of a terrain with their places, and the rounds. Checked before anything of it is shown.

import { isNatural } from "./checks.js";
import { PageError } from "./errors.js";

/**
 * at: place seen from the middle of the ground; look: direction on the ground; picture: number in the sheet.
 * @typedef {{ round: number, at: number[], look: number[], picture?: number }} StoryPhoto
 *
 * preset: whose fit was tested, where it is not the terrain's own.
 * @typedef {{ photos: number, psnr: number | null, preset?: string }} StoryRound
 *
 * half: half the side of the ground that tiles are cut from; thumb: pixels along a side of a photo in the sheet.
 * @typedef {{ unit: string, half: number, photos: StoryPhoto[], rounds: StoryRound[],
 *   thumb: number, columns: number, pictures: number }} Story
 */

export const STORY = "story.json", SHEET = "photos.jpg";
const MOST = 10_000; // photos

/**
 * Throws a PageError: it is no story.
 *
 * @param {any} value parsed JSON
 * @returns {Story}
 */
export function readStory(value) {
  const finite = (/** @type {any} */ v) => Array.isArray(v) && v.every(Number.isFinite);
  const { unit, half, photos, rounds, thumb, columns, pictures } = value ?? {};
  const sound = typeof unit === "string" && unit.length <= 40 && half > 0 && Number.isFinite(half)
    && [thumb, columns, pictures].every(isNatural) && thumb > 0 && thumb <= 512 && columns > 0 && columns <= 64
    && Array.isArray(photos) && photos.length <= MOST && Array.isArray(rounds) && rounds.length <= MOST
    && photos.every((one) => isNatural(one?.round) && finite(one.at) && one.at.length === 3 && finite(one.look)
      && one.look.length === 2 && (one.picture === undefined || (isNatural(one.picture) && one.picture < pictures)))
    && rounds.every((one) => isNatural(one?.photos) && (one.psnr === null || Number.isFinite(one.psnr))
      && (one.preset === undefined || (typeof one.preset === "string" && one.preset.length <= 40)));
  if (!sound) throw new PageError(`${STORY} is not as the workflow writes it. Make the page again.`);
  return { unit, half, photos, rounds, thumb, columns, pictures };
}
