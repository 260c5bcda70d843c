// The worker: keeps the chunks and turns views into frames, so the page's own thread never waits.

import { createHeights } from "../terrain/heights.js";
import { createFrameBuilder } from "./frame_builder.js";

/**
 * @typedef {import("../data/bundle.js").Chunk} Chunk
 *
 * What the page posts.
 * @typedef {{ kind: "begin", manifest: import("../data/manifest.js").Manifest, pixels: Float32Array | null,
 *   pictures: import("../terrain/classes.js").Pictures }} Begin
 * @typedef {{ kind: "view", id: number, camera: import("../terrain/camera.js").Camera, budget: number,
 *   patient: boolean }} View
 * @typedef {Begin | View | { kind: "chunk", chunk: Chunk } | { kind: "restore" }} Request
 *
 * What the worker posts. records: of a chunk that was added, for the GPU.
 * @typedef {{ kind: "records", tile: number, level: number, rows: Uint32Array, records: Uint32Array }} Records
 * @typedef {{ kind: "refused", tile: number, level: number }} Refused
 * @typedef {{ kind: "failed", name: string, message: string }} Failed
 * @typedef {Records | Refused | Failed
 *   | { kind: "frame", frame: import("./frame_builder.js").FrameAnswer }} Reply
 */

/** @type {ReturnType<typeof createFrameBuilder>} */
let builder;

/** @param {Reply} reply @param {Transferable[]} [moved] */
const post = (reply, moved = []) => postMessage(reply, { transfer: moved });

/** @param {import("./chunk_store.js").StoredChunk} chunk */
function postRecords({ tile, level, rows, records }) {
  const copy = records.slice();
  post({ kind: "records", tile, level, rows, records: copy }, [copy.buffer]);
}

/** @param {Chunk} chunk */
function addChunk(chunk) {
  const { tile, level } = chunk;
  if (builder.add(chunk)) postRecords(builder.store.get(tile, level));
  else post({ kind: "refused", tile, level });
}

/** @param {View} view */
function answerView({ id, camera, budget, patient }) {
  const { cells, missing, ...frame } = builder.build(camera, budget, patient);
  const drawn = new Int32Array(6 * cells.length);
  cells.forEach(({ di, dj, tile, lo, hi, direction }, k) => {
    drawn.set([di, dj, tile, lo, hi, direction], 6 * k);
  });
  const { near, marks, blocks, places, uploads } = frame;
  const moved = [near, marks, blocks, places, drawn, uploads.numbers, uploads.data].map((array) => array.buffer);
  post({
    kind: "frame", frame: { ...frame, drawn, id, patient, missing: [...missing], bytes: builder.store.bytes },
  }, moved);
}

/** @param {Request} request */
function answer(request) {
  if (request.kind === "begin") {
    const { manifest, pixels, pictures } = request;
    builder = createFrameBuilder(manifest, createHeights(manifest.heights, pixels), pictures);
  } else if (request.kind === "chunk") addChunk(request.chunk);
  else if (request.kind === "view") answerView(request);
  else { // the GPU has lost everything
    builder.batches.forget();
    for (const chunk of builder.store.all()) postRecords(chunk);
  }
}

addEventListener("message", ({ data }) => {
  try {
    answer(data);
  } catch (error) {
    const { name, message } = /** @type {Error} */ (error);
    post({ kind: "failed", name, message });
  }
});
