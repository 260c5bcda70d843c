// The worker: keeps the chunks, and turns views into what the GPU draws. The page's own thread never waits for it.

import { createHeights } from "./heights.js";
import { createUpdate } from "./update.js";

let update = null;

const answers = {
  begin({ manifest, pixels }) {
    update = createUpdate(manifest, createHeights(manifest.heights, pixels));
  },
  /** A chunk arrived: its records go back, to be brought to the GPU. */
  chunk({ chunk }) {
    const rows = update.add(chunk);
    if (rows) tellRecords(update.store.get(chunk.tile, chunk.level));
    else postMessage({ kind: "refused", tile: chunk.tile, level: chunk.level });
  },
  /** The GPU has lost everything. */
  restore() {
    update.runs.forget();
    for (const chunk of update.store.all()) tellRecords(chunk);
  },
  view({ id, camera, budget, patient }) {
    const { cells, uploads, near, marks, blocks, i0, j0, missing, ...rest } = update.update(camera, budget, patient);
    const drawn = new Int32Array(6 * cells.length); // for people and tests: what is where
    cells.forEach(({ di, dj, tile, lo, hi, direction }, k) => drawn.set([di, dj, tile, lo, hi, direction], 6 * k));
    const made = { i0, j0, near, marks, blocks, uploads, drawn };
    const frame = { ...rest, ...made, id, patient, missing: [...missing], bytes: update.store.bytes };
    const moved = [near, marks, blocks, drawn, uploads.numbers, uploads.data].map((array) => array.buffer);
    postMessage({ kind: "frame", frame }, moved);
  },
};

function tellRecords({ tile, level, rows, records }) {
  const copy = records.slice();
  postMessage({ kind: "records", tile, level, rows, records: copy }, [copy.buffer]);
}

addEventListener("message", ({ data }) => {
  try {
    answers[data.kind](data);
  } catch (error) {
    postMessage({ kind: "failed", name: error.name, message: error.message });
  }
});
