// The endless terrain in other pages: docs/terrain-api.md. Types: terrain_api.d.ts, which a test holds to this file.

import { checkCamera, chooseSun, createChunkReader, createGround, createPainter, describeSun } from "./api/parts.js";
import { openSource } from "./data/bundle.js";
import { PageError } from "./data/checks.js";
import { NO_ORDER } from "./data/layout.js";
import { listDrawnCells, openTerrain, readTerrain } from "./scene/open_terrain.js";
import { cameraAt } from "./terrain/camera.js";

export { PageError as TerrainError } from "./data/checks.js";
export { rayThrough } from "./terrain/camera.js";

const BUDGET = 1_000_000; // Gaussians of an update
const SHADE = 5; // milliseconds of an update for shadows

/**
 * Open a terrain: the address of a page folder or a bundle, its zip, or its files. Resolves when its manifest is read;
 * `loaded` resolves when all its parts are read.
 *
 * @param {string | URL | Blob | Iterable<File>} where
 * @param {{ onProgress?: (progress: import("./data/bundle.js").Progress) => void, onError?: (error: Error) => void }} [options]
 */
export async function load(where, { onProgress, onError = console.error } = {}) {
  const files = await readTerrain(await openSource(where)), { manifest } = files;
  if (manifest.heights?.kind === "sphere") throw new PageError("This terrain is a planet, which other pages cannot show yet.");
  /** @type {Set<ReturnType<typeof createPainter>>} */
  const painters = new Set();
  /** @type {import("./worker/frame_builder.js").FrameAnswer | null} */
  let frame = null;
  let arrived = 0; // chunks that were posted to painters
  let ended = false;
  const checkRunning = () => {
    if (ended) throw new PageError("The terrain was ended: load it again.");
  };
  const open = openTerrain(files, {
    onRecords(records) {
      arrived += 1;
      for (const painter of painters) painter.addRecords(records);
    },
    onFrame(answer) {
      frame = answer;
      for (const painter of painters) painter.setFrame(answer);
    },
    onError,
  });
  const whole = open.readAll(onProgress), loaded = whole.then(() => {});
  loaded.catch(onError); // whoever waits for it learns of it too
  return {
    unit: manifest.unit, tileSide: manifest.tile_side, eyeFloor: manifest.eye_floor, lift: open.lift,
    levels: manifest.levels.length, tiles: manifest.tiles.length, directions: manifest.directions,
    materials: manifest.materials.map(({ name }) => name), objects: (manifest.objects ?? []).map(({ name }) => name),
    feet: (manifest.objects ?? []).map(({ ground }) => ground),
    loaded,
    ...createGround(open),
    ...createChunkReader(open, whole, checkRunning),
    get sun() {
      return describeSun(open);
    },
    /** @param {number | null | "off"} hour */
    setSun: (hour) => chooseSun(open, hour),
    /** @param {import("./terrain/camera.js").Place} place @param {number} width @param {number} height */
    camera: (place, width, height) => checkCamera(cameraAt(place, width, height, open.heights)),
    /** @param {import("./terrain/camera.js").Camera} camera @param {{ budget?: number, exact?: boolean }} [options] */
    async update(camera, { budget = BUDGET, exact = false } = {}) {
      if (!(budget > 0)) throw new RangeError(`budget: ${budget} is not above 0`);
      checkRunning();
      const view = checkCamera(camera);
      open.client.ask(view, budget, exact);
      await open.client.answered();
      if (exact) await open.light?.finish(view.eye);
      checkRunning(); // the end lets whoever waits go on
      const { complete, ...told } = describeUpdate(/** @type {NonNullable<typeof frame>} */ (frame));
      return { ...told, complete: (open.light?.step(view.eye, SHADE) ?? true) && complete };
    },
    /** @param {WebGL2RenderingContext} gl */
    createPainter(gl) {
      const made = createPainter(gl, open, () => painters.delete(made));
      painters.add(made);
      if (arrived) open.client.restore(); // posts what has arrived once more
      return made.painter;
    },
    end() {
      ended = true;
      for (const { painter } of [...painters]) painter.end();
      open.end();
    },
  };
}

/** @param {import("./worker/frame_builder.js").FrameAnswer} frame */
function describeUpdate(frame) {
  const { count, reach, switches, bands, missing, incomplete } = frame;
  const cells = listDrawnCells(frame).map(({ i, j, tile, level, last, order }) => (
    { i, j, tile, finest: level, coarsest: last, order: order === NO_ORDER ? null : order }));
  return { cells, gaussians: count, reach, switches, bands, complete: !incomplete && !missing.length };
}
