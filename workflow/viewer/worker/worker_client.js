// The page's end of the worker: views go out, frames come back; the page draws the last frame and never waits.

const WIDER = 1.25; // times the picture's size, so that a turn finds tiles before the worker has answered

/**
 * @typedef {import("./worker.js").Request} Request
 * @typedef {import("./worker.js").Reply} Reply
 * @typedef {{ onRecords: (records: import("./worker.js").Records) => void,
 *   onRefused: (chunk: import("./worker.js").Refused) => void,
 *   onFrame: (frame: import("./frame_builder.js").FrameAnswer) => void, onError: (error: Error) => void }} Handlers
 * @typedef {ReturnType<typeof createWorkerClient>} WorkerClient
 */

/**
 * @param {Omit<import("./worker.js").Begin, "kind">} bundle
 * @param {Handlers} handlers
 */
export function createWorkerClient(bundle, { onRecords, onRefused, onFrame, onError }) {
  const worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
  let id = 0, answered = 0, busy = false, ended = false;
  /** @type {{ id: number, resolve: () => void, reject: (error: Error) => void }[]} */
  let waiting = [];
  /** @param {Request} request @param {Transferable[]} [moved] */
  const post = (request, moved = []) => worker.postMessage(request, moved);
  /** @param {Error} error */
  const fail = (error) => {
    for (const { reject } of waiting.splice(0)) reject(error);
    onError(error);
  };
  /** @param {import("./frame_builder.js").FrameAnswer} frame */
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
    const reply = /** @type {Reply} */ (event.data);
    if (reply.kind === "failed") fail(Object.assign(new Error(reply.message), { name: reply.name }));
    else if (reply.kind === "frame") takeFrame(reply.frame);
    else if (reply.kind === "records") onRecords(reply);
    else onRefused(reply);
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
    /** @param {import("../data/bundle.js").Chunk} chunk */
    add: (chunk) => post({ kind: "chunk", chunk }, [chunk.buffer]),
    /** Post all records again: the GPU has lost them. */
    restore: () => post({ kind: "restore" }),
    /** Paint points: I, J and material of each. @param {Int32Array} points */
    paint: (points) => post({ kind: "paint", points }),
    /** @param {import("./worker.js").Changes} changes */
    adjust: (changes) => post({ kind: "adjust", changes }),
    /**
     * Ask for the frame of a camera.
     *
     * @param {import("../terrain/camera.js").Camera} camera
     * @param {number} budget
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
      for (const { resolve } of waiting.splice(0)) resolve();
      worker.terminate();
    },
  };
}
