// Small pictures of objects, from the side and a little from above, drawn from their records without the GPU: that
// takes milliseconds, needs no file, and leaves the page's context and its frame alone.

import { createChunkReader } from "../api/parts.js";

/** @typedef {import("../api/parts.js").Gaussians} Gaussians */

export const SIZE = 72; // pixels along a side
const MOST = 3000; // Gaussians of a picture: a finer level would look the same
const RISE = (20 * Math.PI) / 180; // of the eye above the horizon
const MARGIN = 3, WIDEST = 3; // pixels around it; standard deviations that are drawn of a Gaussian
const STRAY = 0.01; // share of the Gaussians at each side that the picture may cut off

/**
 * Draw a terrain's objects, one canvas each. All of its parts must have been read.
 *
 * @param {Pick<import("../scene/open_terrain.js").OpenTerrain, "manifest" | "client">} terrain
 * @param {HTMLCanvasElement[]} canvases
 */
export async function drawThumbnails(terrain, canvases) {
  const { tiles, objects = [] } = terrain.manifest;
  const { gaussians } = createChunkReader(terrain, Promise.resolve(true), () => {});
  for (const [k, canvas] of canvases.entries()) {
    const chunks = [...objects[k].chunks].sort((a, b) => a.level - b.level);
    const { level } = chunks.find(({ count }) => count <= MOST) ?? chunks[chunks.length - 1];
    const pixels = drawGaussians(await gaussians(tiles.length + k, level));
    Object.assign(canvas, { width: SIZE, height: SIZE });
    canvas.getContext("2d")?.putImageData(new ImageData(pixels, SIZE, SIZE), 0, 0);
  }
}

/**
 * RGBA bytes of a picture in which the Gaussians fill SIZE x SIZE pixels. Orthographic: the shape of each is projected,
 * widened by 0.3 square pixels as on the page, and laid over those behind it.
 *
 * @param {Gaussians} gaussians
 */
export function drawGaussians({ count, centres, deviations, turns, colours }) {
  const high = Math.cos(RISE), deep = Math.sin(RISE), picture = new Float32Array(4 * SIZE * SIZE);
  /** Right, up and away from the eye. @param {ArrayLike<number>} v @param {number} at */
  const turn = (v, at) => [v[at], deep * v[at + 1] + high * v[at + 2], high * v[at + 1] - deep * v[at + 2]];
  const places = Array.from({ length: count }, (_, k) => turn(centres, 3 * k));
  const [[west, east], [low, top]] = [0, 1].map((axis) => {
    const sorted = places.map((place) => place[axis]).sort((a, b) => a - b), cut = Math.floor(STRAY * count);
    return [sorted[cut] ?? 0, sorted[count - 1 - cut] ?? 0];
  });
  const scale = (SIZE - 2 * MARGIN) / Math.max(east - west, top - low, 1e-9);
  const order = Array.from(places.keys()).sort((a, b) => places[b][2] - places[a][2]);
  for (const k of order) {
    const [w, x, y, z] = turns.subarray(4 * k, 4 * k + 4);
    const [red, green, blue, opacity] = colours.subarray(4 * k, 4 * k + 4);
    const axes = [
      [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
      [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
      [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ].map((axis, n) => turn(axis, 0).map((v) => v * scale * deviations[3 * k + n]));
    const a = axes.reduce((sum, [u]) => sum + u * u, 0.3), c = axes.reduce((sum, [, v]) => sum + v * v, 0.3);
    const b = axes.reduce((sum, [u, v]) => sum + u * v, 0), det = a * c - b * b;
    const across = SIZE / 2 + scale * (places[k][0] - (west + east) / 2);
    const down = SIZE / 2 - scale * (places[k][1] - (low + top) / 2);
    const wide = WIDEST * Math.sqrt(a), tall = WIDEST * Math.sqrt(c), [right, bottom] = [across + wide, down + tall];
    for (let j = Math.max(0, Math.ceil(down - tall - 0.5)); j < SIZE && j + 0.5 <= bottom; j++) {
      for (let i = Math.max(0, Math.ceil(across - wide - 0.5)); i < SIZE && i + 0.5 <= right; i++) {
        const u = i + 0.5 - across, v = down - j - 0.5, at = 4 * (j * SIZE + i);
        const share = opacity * Math.exp((b * u * v - 0.5 * (c * u * u + a * v * v)) / det);
        picture[at] += share * (red - picture[at]);
        picture[at + 1] += share * (green - picture[at + 1]);
        picture[at + 2] += share * (blue - picture[at + 2]);
        picture[at + 3] += share * (1 - picture[at + 3]);
      }
    }
  }
  // the colours above are premultiplied, a canvas needs straight alpha
  return Uint8ClampedArray.from(picture, (v, n) => 255 * (n % 4 === 3 ? v : v / (picture[n | 3] || 1)));
}
