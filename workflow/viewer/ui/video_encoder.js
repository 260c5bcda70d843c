// Videos frame by frame, however long a frame takes: WebCodecs encode, and all frames are kept until the file is written.

import { writeWebm } from "../data/webm.js";

/** @typedef {NonNullable<Awaited<ReturnType<typeof findEncoder>>>} Settings */

export const RATE = 30; // frames a second
const CODECS = /** @type {const} */ ([["vp09.00.51.08", "V_VP9"], ["vp8", "V_VP8"]]);
const BITS = 0.25; // a pixel and frame: ground is all texture
const KEY_EVERY = 2 * RATE; // frames from one key frame to the next
const QUEUE = 4; // frames that wait for the encoder at most

/**
 * The settings of the first codec that encodes videos of a size; null: this browser has none.
 *
 * @param {number} width even
 * @param {number} height even
 */
export async function findEncoder(width, height) {
  if (!("VideoEncoder" in globalThis)) return null;
  for (const [codec, name] of CODECS) {
    /** @type {VideoEncoderConfig} */
    const config = { codec, width, height, framerate: RATE, bitrate: Math.round(BITS * RATE * width * height) };
    const { supported } = await VideoEncoder.isConfigSupported(config).catch(() => ({ supported: false }));
    if (supported) return { config, name };
  }
  return null;
}

/**
 * The video of some frames.
 *
 * @param {Settings} settings
 * @param {number} count of frames
 * @param {(k: number) => Promise<HTMLCanvasElement>} draw a frame
 * @returns {Promise<Blob>}
 */
export async function encodeVideo({ config, name }, count, draw) {
  /** @type {import("../data/webm.js").EncodedFrame[]} */
  const frames = [];
  /** @type {DOMException | null} */
  let failed = null;
  const encoder = new VideoEncoder({
    output(chunk) {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      frames.push({ data, milliseconds: Math.round(chunk.timestamp / 1000), key: chunk.type === "key" });
    },
    error: (error) => (failed = error),
  });
  try {
    encoder.configure(config);
    for (let k = 0; k < count; k++) {
      const frame = new VideoFrame(await draw(k), { timestamp: (1e6 * k) / RATE, duration: 1e6 / RATE });
      encoder.encode(frame, { keyFrame: k % KEY_EVERY === 0 });
      frame.close();
      while (encoder.encodeQueueSize > QUEUE && !failed) await new Promise((done) => setTimeout(done, 4));
      if (failed) throw failed;
    }
    await encoder.flush();
  } finally {
    if (encoder.state !== "closed") encoder.close();
  }
  const track = { codec: name, width: config.width, height: config.height, duration: (1000 * count) / RATE };
  return new Blob([writeWebm(track, frames)], { type: "video/webm" });
}
