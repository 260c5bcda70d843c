// The worker: keeps the chunks and turns views into frames, so the page's own thread never waits.

import { createHeights } from "../terrain/heights.js";
import { createFrameBuilder } from "./frame_builder.js";

/**
 * @typedef {import("../data/bundle.js").Chunk} Chunk
 *
 * What the page posts.
 * @typedef {{ kind: "begin", manifest: import("../data/manifest.js").Manifest, pixels: Float32Array | null }} Begin
 * @typedef {{ kind: "view", id: number, camera: import("../terrain/camera.js").Camera, budget: number,
 *   patient: boolean }} View
 * @typedef {{ offsets: number[] | null, probabilities: number[] | null }} Changes see `adjustCover`
 * @typedef {Begin | View | { kind: "chunk", chunk: Chunk } | { kind: "restore" }
 *   | { kind: "paint", points: Int32Array } | { kind: "adjust", changes: Changes }} Request
 *
 * What the worker posts. records: of a chunk that was added, for the GPU.
 * @typedef {{ kind: "records", tile: number, level: number, rows: Uint32Array, records: Uint32Array }} Records
 * @typedef {{ kind: "refused", tile: number, level: number }} Refused
 * @typedef {{ kind: "failed", name: string, message: string }} Failed
 * @typedef {Records | Refused | Failed
 *   | { kind: "frame", frame: import("./frame_builder.js").FrameAnswer }} Reply
 */

const SLICE = 2; // milliseconds of work between two looks for messages

/** @type {ReturnType<typeof createFrameBuilder>} */
let builder;
let busy = false; // a turn of working ahead is due

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

/** Between views: work ahead, in slices, so that the next one waits for little. */
function workAhead() {
  busy = builder.workAhead(SLICE);
  if (busy) setTimeout(() => attempt(workAhead));
}

/** @param {Request} request */
function answer(request) {
  if (request.kind === "begin") {
    const { manifest, pixels } = request;
    builder = createFrameBuilder(manifest, createHeights(manifest.heights, pixels));
  } else if (request.kind === "chunk") addChunk(request.chunk);
  else if (request.kind === "view") {
    answerView(request);
    if (!busy) setTimeout(() => attempt(workAhead));
    busy = true;
  }
  else if (request.kind === "paint") builder.paint(request.points);
  else if (request.kind === "adjust") builder.adjust(request.changes);
  else { // the GPU has lost everything
    builder.batches.forget();
    for (const chunk of builder.store.all()) postRecords(chunk);
  }
}

/** Tell the page what goes wrong. @param {() => void} act */
function attempt(act) {
  try {
    act();
  } catch (error) {
    const { name, message } = /** @type {Error} */ (error);
    post({ kind: "failed", name, message });
  }
}

addEventListener("message", ({ data }) => attempt(() => answer(data)));
