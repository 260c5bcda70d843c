// An open terrain: its manifest and surface, the worker that chooses what is drawn, and the reading of its parts. The
// page and the importable terrain (terrain_api.js) have this in common.

import { readHeightMap, readManifest, readParts } from "../data/bundle.js";
import { PageError } from "../data/checks.js";
import { REACH } from "../terrain/cells.js";
import { createHeights } from "../terrain/heights.js";
import { createLight } from "../terrain/light.js";
import { findEnd, findReach } from "../terrain/sphere_cells.js";

const WIDER = 1.25; // times the picture's size, so that a turn finds tiles before the worker has answered
const MIN_LOW = 1e-4; // sine of the angle below the horizon at which tiles end, at least

/**
 * @typedef {import("../worker/frame_builder.js").FrameAnswer} FrameAnswer
 *
 * i, j: the cell; tile: the one in it, of the first material that shows; level to last: the levels of detail that are
 * drawn; order: index of the direction of its pre-sorted order, NO_ORDER where it is sorted by depth.
 * @typedef {{ i: number, j: number, tile: number, level: number, last: number, order: number }} DrawnCell
 *
 * What is read before anything is drawn.
 * @typedef {{ source: import("../data/source.js").Source, manifest: import("../data/manifest.js").Manifest,
 *   pixels: Float32Array | null }} TerrainFiles
 *
 * @typedef {{ onRecords: (records: import("../worker/worker.js").Records) => void,
 *   onFrame: (frame: FrameAnswer) => void, onError: (error: Error) => void }} Handlers
 * @typedef {ReturnType<typeof createWorkerClient>} WorkerClient
 * @typedef {ReturnType<typeof openTerrain>} OpenTerrain
 */

/**
 * Read manifest and height map. Throws a PageError.
 *
 * @param {import("../data/source.js").Source} source
 * @returns {Promise<TerrainFiles>}
 */
export async function readTerrain(source) {
  const manifest = await readManifest(source), pixels = await readHeightMap(manifest, source);
  return { source, manifest, pixels };
}

/** Start the worker of a terrain. @param {TerrainFiles} files @param {Handlers} handlers */
export function openTerrain({ source, manifest, pixels }, handlers) {
  const stop = new AbortController(), client = createWorkerClient({ manifest, pixels }, handlers);
  const heights = createHeights(manifest.heights, pixels);
  return {
    manifest, client, heights, light: createLight(manifest, heights),
    /** Mean height of the ground of its tiles above the surface. */
    lift: mean(manifest.classes?.rise.ground ?? [0]),
    /**
     * Read all parts. Returns: were they unpacked, and not ended meanwhile? Throws a PageError.
     *
     * @param {(progress: import("../data/bundle.js").Progress) => void} [onProgress]
     */
    async readAll(onProgress) {
      try {
        await readParts(manifest, source, { take: client.addPart, onProgress, signal: stop.signal });
      } catch (error) {
        if (!stop.signal.aborted) throw error;
      }
      return !stop.signal.aborted;
    },
    /** Stop the worker and all reading. */
    end() {
      stop.abort();
      client.end();
    },
  };
}

/**
 * The page's end of the worker: views go out, frames come back; the page draws the last frame and never waits.
 *
 * @param {Omit<import("../worker/worker.js").Begin, "kind">} bundle @param {Handlers} handlers
 */
function createWorkerClient(bundle, { onRecords, onFrame, onError }) {
  const worker = new Worker(new URL("../worker/worker.js", import.meta.url), { type: "module" });
  let id = 0, answered = 0, busy = false, ended = false;
  /** @type {{ id: number, resolve: () => void, reject: (error: Error) => void }[]} */
  let waiting = [];
  let asked = 0;
  /** @type {Map<string, { resolve: (records?: Uint32Array) => void, reject: (error: Error) => void }>} */
  const promised = new Map(); // parts to be unpacked, and records that were asked for
  /** @param {string} key @returns {Promise<Uint32Array | undefined>} */
  const promise = (key) => (
    ended ? Promise.resolve(undefined) : new Promise((resolve, reject) => promised.set(key, { resolve, reject })));
  /** @param {string} key @param {Uint32Array} [records] */
  const keep = (key, records) => {
    promised.get(key)?.resolve(records);
    promised.delete(key);
  };
  /** @param {import("../worker/worker.js").Request} request @param {Transferable[]} [moved] */
  const post = (request, moved = []) => worker.postMessage(request, moved);
  /** @param {Error} error */
  const fail = (error) => {
    for (const { reject } of [...waiting.splice(0), ...promised.values()]) reject(error);
    promised.clear();
    onError(error);
  };
  /** @param {FrameAnswer} frame */
  const takeFrame = (frame) => {
    answered = frame.id;
    busy = answered < id;
    onFrame(frame);
    const due = waiting.filter((one) => one.id <= answered);
    waiting = waiting.filter((one) => one.id > answered);
    for (const { resolve } of due) resolve();
  };
  worker.addEventListener("message", (event) => {
    if (ended) return;
    const reply = /** @type {import("../worker/worker.js").Reply} */ (event.data);
    if (reply.kind === "failed") {
      fail(reply.said ? new PageError(reply.message) : Object.assign(new Error(reply.message), { name: reply.name }));
    } else if (reply.kind === "frame") takeFrame(reply.frame);
    else if (reply.kind === "records") onRecords(reply);
    else if (reply.kind === "part") keep(`part ${reply.index}`);
    else keep(`asked ${reply.id}`, reply.records);
  });
  worker.addEventListener("error", (event) => {
    event.preventDefault();
    fail(new Error(event.message || "the worker did not start"));
  });
  post({ kind: "begin", ...bundle });
  return {
    /** Is no answer outstanding? */
    get idle() {
      return !busy;
    },
    /** Resolves when the part is unpacked. @param {number} index @param {ArrayBuffer} buffer */
    async addPart(index, buffer) {
      post({ kind: "part", index, buffer }, [buffer]);
      await promise(`part ${index}`);
    },
    /** Records of a chunk, when all parts are there; undefined: stopped. @param {number} tile @param {number} level */
    recordsOf(tile, level) {
      post({ kind: "ask", id: ++asked, tile, level });
      return promise(`asked ${asked}`);
    },
    /** Post all records again: the GPU has lost them. */
    restore: () => post({ kind: "restore" }),
    /** Paint points: I, J and material of each. @param {Int32Array} points */
    paint: (points) => post({ kind: "paint", points }),
    /** @param {import("../worker/worker.js").Changes} changes */
    adjust: (changes) => post({ kind: "adjust", changes }),
    /**
     * Ask for the frame of a camera.
     *
     * @param {import("../terrain/camera.js").Camera} camera @param {number} budget
     * @param {boolean} patient exactly this view, with every batch made; else a wider one, soon
     */
    ask(camera, budget, patient) {
      const wider = patient ? camera : { ...camera, width: camera.width * WIDER, height: camera.height * WIDER };
      busy = true;
      post({ kind: "view", id: ++id, camera: wider, budget, patient });
    },
    /** Resolves when the last view so far is answered. @returns {Promise<void>} */
    answered: () => (answered >= id
      ? Promise.resolve()
      : new Promise((resolve, reject) => waiting.push({ id, resolve, reject }))),
    /** Stop the worker; whoever waits goes on. */
    end() {
      ended = true;
      for (const { resolve } of [...waiting.splice(0), ...promised.values()]) resolve();
      worker.terminate();
    },
  };
}

/** @param {number[]} values */
const mean = (values) => values.reduce((sum, v) => sum + v, 0) / values.length;

/**
 * Where the tiles of a picture end and its backdrop begins, and the light on both: `end`, `low` and `light` of the
 * options that renderers take.
 *
 * @param {Pick<OpenTerrain, "manifest" | "heights" | "light">} terrain
 * @param {FrameAnswer | null} frame the last one
 * @param {import("../terrain/camera.js").Camera} camera
 */
export function backdropOptions({ manifest, heights, light }, frame, camera) {
  const farthest = REACH * manifest.tile_side;
  if (heights.kind === "sphere") {
    const reach = frame?.reach ?? findReach({ side: manifest.tile_side }, heights, camera.eye);
    return { ...findEnd(heights, camera.eye, reach), light: null };
  }
  const low = Math.max(MIN_LOW, (camera.eye[2] - heights.low) / farthest);
  return { end: frame?.reach ?? farthest, low, light: light?.now ?? null };
}

/** The cells of a frame, back to front. @param {FrameAnswer} frame @returns {DrawnCell[]} */
export function listDrawnCells({ drawn, i0, j0 }) {
  const cells = [];
  for (let k = 0; k < drawn.length; k += 6) {
    const [di, dj, tile, level, last, order] = drawn.subarray(k, k + 6);
    cells.push({ i: i0 + di, j: j0 + dj, tile, level, last, order });
  }
  return cells;
}
