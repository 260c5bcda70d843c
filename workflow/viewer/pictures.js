// The link to the worker: views go out, what to draw comes back; the page draws what came last and never waits.

const WIDER = 1.25; // of the picture on all sides together, so that a turn finds tiles before the worker has answered

/** told: { records, refused, frame, failed } are called with what the worker says. */
export function createPictures(manifest, pixels, told) {
  const worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
  let id = 0, answered = 0, busy = false, ended = false, waiting = [];
  const failed = (error) => {
    for (const { no } of waiting.splice(0)) no(error);
    told.failed(error);
  };
  worker.addEventListener("message", ({ data }) => {
    if (ended) return;
    if (data.kind === "failed") return failed(Object.assign(new Error(data.message), { name: data.name }));
    if (data.kind === "frame") {
      answered = data.frame.id;
      busy = answered < id;
    }
    told[data.kind](data.kind === "frame" ? data.frame : data);
    if (data.kind === "frame") {
      const due = waiting.filter((one) => one.id <= answered);
      waiting = waiting.filter((one) => one.id > answered);
      for (const { done } of due) done();
    }
  });
  worker.addEventListener("error", (event) => {
    event.preventDefault();
    failed(new Error(event.message || "the worker did not start"));
  });
  worker.postMessage({ kind: "begin", manifest, pixels });
  return {
    /** Is no answer outstanding? */
    get idle() {
      return !busy;
    },
    add: (chunk) => worker.postMessage({ kind: "chunk", chunk }, [chunk.buffer]),
    restore: () => worker.postMessage({ kind: "restore" }),
    /** Ask for what this camera sees. patient: exactly that, with every order made; else a little more, and soon. */
    ask(camera, budget, patient) {
      const wider = patient ? camera : { ...camera, width: camera.width * WIDER, height: camera.height * WIDER };
      busy = true;
      worker.postMessage({ kind: "view", id: ++id, camera: wider, budget, patient });
    },
    /** Resolves when the last question so far is answered. */
    answered: () => (answered >= id ? Promise.resolve() : new Promise((done, no) => waiting.push({ id, done, no }))),
    /** Nothing more is answered; whoever waits goes on. */
    end() {
      ended = true;
      for (const { done } of waiting.splice(0)) done();
      worker.terminate();
    },
  };
}
