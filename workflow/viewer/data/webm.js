// WebM files of one video track, https://www.webmproject.org/docs/container: a cluster for every key frame, and cues so
// that players can jump to each.

/**
 * milliseconds: of the frame, from the start.
 * @typedef {{ data: Uint8Array, milliseconds: number, key: boolean }} EncodedFrame
 * @typedef {{ codec: "V_VP8" | "V_VP9", width: number, height: number, duration: number }} Track duration: milliseconds
 */

const EBML = 0x1a45dfa3, EBML_VERSION = 0x4286, EBML_READ_VERSION = 0x42f7, EBML_MAX_ID = 0x42f2, EBML_MAX_SIZE = 0x42f3;
const DOC_TYPE = 0x4282, DOC_VERSION = 0x4287, DOC_READ_VERSION = 0x4285;
const SEGMENT = 0x18538067, INFO = 0x1549a966, TIMESTAMP_SCALE = 0x2ad7b1, DURATION = 0x4489, MUXER = 0x4d80, WRITER = 0x5741;
const TRACKS = 0x1654ae6b, ENTRY = 0xae, NUMBER = 0xd7, UID = 0x73c5, TYPE = 0x83, CODEC = 0x86, LACING = 0x9c;
const VIDEO = 0xe0, WIDTH = 0xb0, HEIGHT = 0xba;
const CUES = 0x1c53bb6b, POINT = 0xbb, CUE_TIME = 0xb3, POSITIONS = 0xb7, CUE_TRACK = 0xf7, CUE_CLUSTER = 0xf1;
const CLUSTER = 0x1f43b675, TIMESTAMP = 0xe7, SIMPLE_BLOCK = 0xa3;
const NANOSECONDS = 1e6; // in a millisecond, the unit of all times
const TRACK = 1, KEY = 0x80;
const LONGEST = 32767; // milliseconds of a cluster: frames count from its start in 16 bits

/**
 * The file of frames, in order of their times; the first is a key frame. Throws a RangeError: it is none.
 *
 * @param {Track} track
 * @param {EncodedFrame[]} frames
 * @returns {Uint8Array<ArrayBuffer>}
 */
export function writeWebm(track, frames) {
  const clusters = groupFrames(frames), bodies = clusters.map(writeCluster);
  const front = [writeInfo(track), writeTracks(track)];
  const cues = (/** @type {number[]} */ places) => element(CUES, ...places.map((place, k) => element(POINT,
    number(CUE_TIME, clusters[k][0].milliseconds),
    element(POSITIONS, number(CUE_TRACK, TRACK), number(CUE_CLUSTER, place)))));
  // all numbers have eight bytes, so cues are as long whatever they say
  let place = front.reduce((sum, { length }) => sum + length, 0) + cues(clusters.map(() => 0)).length;
  const places = bodies.map(({ length }) => {
    place += length;
    return place - length;
  });
  return join([
    element(EBML, number(EBML_VERSION, 1), number(EBML_READ_VERSION, 1), number(EBML_MAX_ID, 4), number(EBML_MAX_SIZE, 8),
      text(DOC_TYPE, "webm"), number(DOC_VERSION, 4), number(DOC_READ_VERSION, 2)),
    element(SEGMENT, ...front, cues(places), ...bodies),
  ]);
}

/** @param {EncodedFrame[]} frames */
function groupFrames(frames) {
  if (!frames[0]?.key) throw new RangeError("a video begins with a key frame");
  /** @type {EncodedFrame[][]} */
  const groups = [];
  for (const frame of frames) {
    if (frame.key) groups.push([frame]);
    else if (frame.milliseconds - groups[groups.length - 1][0].milliseconds > LONGEST) {
      throw new RangeError("key frames are too far from each other");
    } else groups[groups.length - 1].push(frame);
  }
  return groups;
}

/** @param {EncodedFrame[]} frames */
function writeCluster(frames) {
  const start = frames[0].milliseconds;
  return element(CLUSTER, number(TIMESTAMP, start), ...frames.map(({ data, milliseconds, key }) => {
    const later = milliseconds - start;
    return element(SIMPLE_BLOCK, Uint8Array.of(0x80 | TRACK, later >> 8, later & 255, key ? KEY : 0), data);
  }));
}

/** @param {Track} track */
function writeInfo({ duration }) {
  const long = new Uint8Array(8);
  new DataView(long.buffer).setFloat64(0, duration);
  return element(INFO, number(TIMESTAMP_SCALE, NANOSECONDS), element(DURATION, long), text(MUXER, "DAV-GSWT"),
    text(WRITER, "DAV-GSWT"));
}

/** @param {Track} track */
const writeTracks = ({ codec, width, height }) => element(TRACKS, element(ENTRY,
  number(NUMBER, TRACK), number(UID, TRACK), number(TYPE, 1), number(LACING, 0), text(CODEC, codec),
  element(VIDEO, number(WIDTH, width), number(HEIGHT, height))));

/** An element of EBML: id, length in eight bytes, parts. @param {number} id @param {Uint8Array[]} parts */
function element(id, ...parts) {
  const head = [24, 16, 8, 0].map((shift) => (id >>> shift) & 255), from = head.findIndex((v) => v > 0);
  const length = bytesOf(parts.reduce((sum, part) => sum + part.length, 0));
  length[0] = 1; // says that eight bytes hold the length
  return join([Uint8Array.from(head.slice(from)), length, ...parts]);
}

/** @param {number} id @param {number} value */
const number = (id, value) => element(id, bytesOf(value));
/** @param {number} id @param {string} value */
const text = (id, value) => element(id, new TextEncoder().encode(value));

/** Eight bytes, the highest first. @param {number} value */
function bytesOf(value) {
  const bytes = new Uint8Array(8);
  new DataView(bytes.buffer).setBigUint64(0, BigInt(Math.round(value)));
  return bytes;
}

/** @param {Uint8Array[]} parts */
function join(parts) {
  const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}
