// Videos where there is no encoder of single frames: the canvas is recorded while the fly path plays.

import { RATE } from "./video_encoder.js";

const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];
const BITS = 12e6; // a second
const EVERY = 100; // milliseconds between looks at the path

/** What this browser records a canvas as; undefined: nothing. @param {HTMLCanvasElement} canvas */
export const findRecording = (canvas) => ("MediaRecorder" in globalThis && "captureStream" in canvas
  ? KINDS.find((kind) => MediaRecorder.isTypeSupported(kind))
  : undefined);

/**
 * Record the fly path while it plays. Throws the signal's reason when it is aborted.
 *
 * @param {import("./viewer.js").Viewer} viewer
 * @param {string} kind
 * @param {AbortSignal} signal
 * @param {(share: number) => void} tell
 * @returns {Promise<Blob>}
 */
export async function recordLive(viewer, kind, signal, tell) {
  const { flyPath, canvas } = viewer, stream = canvas.captureStream(RATE);
  const recorder = new MediaRecorder(stream, { mimeType: kind, videoBitsPerSecond: BITS });
  /** @type {Blob[]} */
  const parts = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  const stopped = new Promise((done) => recorder.addEventListener("stop", done, { once: true }));
  const begin = performance.now(), seconds = flyPath.path[flyPath.path.length - 1].seconds;
  recorder.start();
  flyPath.play();
  viewer.redraw();
  try {
    while (flyPath.mode === "play") {
      await new Promise((done) => setTimeout(done, EVERY));
      signal.throwIfAborted();
      tell(Math.min(1, (performance.now() - begin) / 1000 / Math.max(seconds, 0.1)));
    }
  } finally {
    flyPath.stop();
    recorder.stop();
    await stopped;
    for (const track of stream.getTracks()) track.stop();
  }
  return new Blob(parts, { type: kind.split(";")[0] });
}
