// The worker: composes chunks and turns views into frames, so the page's own thread never waits.

import { PageError } from "../data/checks.js";
import { createHeights } from "../terrain/heights.js";
import { createFrameBuilder } from "./frame_builder.js";

/**
 * What the page posts.
 * @typedef {{ kind: "begin", manifest: import("../data/manifest.js").Manifest, pixels: Float32Array | null }} Begin
 * @typedef {{ kind: "view", id: number, camera: import("../terrain/camera.js").Camera, budget: number,
 *   patient: boolean }} View
 * @typedef {{ offsets: number[] | null, probabilities: number[] | null }} Changes see `adjustCover`
 * @typedef {Begin | View | { kind: "part", index: number, buffer: ArrayBuffer } | { kind: "restore" }
 *   | { kind: "ask", id: number, tile: number, level: number }
 *   | { kind: "paint", points: Int32Array } | { kind: "adjust", changes: Changes }} Request
 *
 * What the worker posts. records: of a chunk that was composed, for the GPU; part: it was unpacked; told: what was asked.
 * @typedef {{ kind: "records", tile: number, level: number, rows: Uint32Array, records: Uint32Array }} Records
 * @typedef {{ kind: "failed", said: boolean, name: string, message: string }} Failed said: as a PageError
 * @typedef {Records | Failed | { kind: "part", index: number } | { kind: "told", id: number, records: Uint32Array }
 *   | { kind: "frame", frame: import("./frame_builder.js").FrameAnswer }} Reply
 */

const SLICE = 1; // milliseconds of work between two looks for messages

/** @type {ReturnType<typeof createFrameBuilder>} */
let builder;
let busy = false; // a turn of working ahead is due
const turns = new MessageChannel(); // without the pauses that timers make

/** @param {Reply} reply @param {Transferable[]} [moved] */
const post = (reply, moved = []) => postMessage(reply, { transfer: moved });

/** @param {import("./chunk_store.js").StoredChunk} chunk */
function postRecords({ tile, level, rows, records }) {
  const copy = records.slice();
  post({ kind: "records", tile, level, rows, records: copy }, [copy.buffer]);
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
    kind: "frame", frame: { ...frame, drawn, id, patient, missing: [...missing] },
  }, moved);
}

/** Between views: work ahead, in slices, so that the next one waits for little. */
turns.port1.onmessage = () => {
  busy = false;
  let more = true; // also where a step fails
  attempt(() => (more = builder.workAhead(SLICE)));
  if (more) beBusy();
};

function beBusy() {
  if (!busy) turns.port2.postMessage(null);
  busy = true;
}

/** @param {Request} request */
function answer(request) {
  if (request.kind === "begin") {
    const { manifest, pixels } = request;
    builder = createFrameBuilder(manifest, createHeights(manifest.heights, pixels), {
      onChunk: postRecords, onPart: (index) => post({ kind: "part", index }),
    });
  } else if (request.kind === "part") {
    builder.supply.addPart(request.index, request.buffer);
    beBusy();
  } else if (request.kind === "view") {
    answerView(request);
    beBusy();
  } else if (request.kind === "ask") {
    const records = builder.supply.recordsOf(request.tile, request.level).slice();
    post({ kind: "told", id: request.id, records }, [records.buffer]);
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
    post({ kind: "failed", said: error instanceof PageError, name, message });
  }
}

addEventListener("message", ({ data }) => attempt(() => answer(data)));
