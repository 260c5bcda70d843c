// A video of the fly path: frame by frame where the browser encodes frames, else recorded while the path plays.

import { BUDGET } from "../draw/frame_pacing.js";
import { capturing } from "./capture.js";
import { element, saveFile } from "./dom.js";
import { placeAt } from "./fly_path.js";
import { findRecording, recordLive } from "./live_video.js";
import { encodeVideo, findEncoder, RATE } from "./video_encoder.js";

const LONGEST = 1920; // pixels of the longer side
const MOST_SECONDS = 600; // of a video: its frames are kept until it is whole
const EVERY = 250; // milliseconds between looks at whether there is a path
const QUICK = 250_000; // Gaussians a frame, at least, of a video that shall be made soon
const TOO_LONG = "A video has ten minutes at most. Record a shorter fly path.";

/** The size of a video of what is shown: even numbers, which encoders ask for. @param {{ width: number, height: number }} shown */
export function videoSize({ width, height }) {
  const scale = Math.min(1, LONGEST / Math.max(width, height));
  /** @param {number} size */
  const even = (size) => Math.max(2, 2 * Math.round((scale * size) / 2));
  return { width: even(width), height: even(height) };
}

/**
 * @param {import("./viewer.js").Viewer} viewer
 * @param {import("./job.js").Jobs} jobs
 * @param {() => void} closePanels
 */
export function listenToVideo(viewer, jobs, closePanels) {
  const button = element("video", HTMLButtonElement), quality = element("videoQuality", HTMLSelectElement);
  const note = element("videoNote", HTMLElement), { flyPath } = viewer;
  const kind = findRecording(viewer.canvas);
  const canEncode = "VideoEncoder" in globalThis;
  if (!canEncode) note.textContent = kind ? "This browser records videos while the path plays." : "This browser makes no videos.";
  note.hidden = canEncode;
  quality.disabled = !canEncode;

  /** @param {AbortSignal} signal @param {(share: number) => void} tell @returns {Promise<Blob | null>} */
  async function make(signal, tell) {
    const { scene } = viewer;
    if (!scene) return null;
    const size = videoSize(viewer.camera(scene)), encoder = await findEncoder(size.width, size.height);
    if (!encoder) return kind ? recordLive(viewer, kind, signal, tell) : null;
    const { path } = flyPath, count = Math.max(1, Math.floor(path[path.length - 1].seconds * RATE) + 1);
    const budget = quality.value === "quick" ? Math.max(QUICK, viewer.pacing.budget) : BUDGET.most;
    /** @type {Blob | null} */
    let blob = null;
    await capturing(viewer, { ...size, signal }, async (capture) => {
      blob = await encodeVideo(encoder, count, (k) =>
        capture(placeAt(path, k / RATE), budget, (share) => tell((k + share) / count)));
    });
    return blob;
  }

  button.addEventListener("click", () => jobs.run("Making the video", async (signal, tell) => {
    flyPath.stop();
    closePanels();
    if (flyPath.path[flyPath.path.length - 1].seconds > MOST_SECONDS) return viewer.hud.say(TOO_LONG);
    const blob = await make(signal, tell);
    if (!blob) return viewer.hud.say("This browser makes no videos.");
    saveFile(blob, blob.type === "video/mp4" ? "-flight.mp4" : "-flight.webm");
    viewer.hud.say("The video is saved.");
  }));
  setInterval(() => (button.disabled = !flyPath.path.length || !(canEncode || kind)), EVERY);
}
