// Reads what is dropped onto the page as the page does, without its pictures: node open_files.mjs VIEWER.
// One line of JSON a request on stdin, one an answer: { files: { name: base64 }, zip } -> { read } or { refused }.

import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const viewer = pathToFileURL(`${process.argv[2]}/`);
const load = (name) => import(new URL(name, viewer));
const { readHeightMap, readManifest, readParts, sourceOf } = await load("data/bundle.js");
const { PageError } = await load("data/checks.js");
const { openZip } = await load("data/source.js");
const { cameraAt } = await load("terrain/camera.js");
const { createHeights } = await load("terrain/heights.js");
const { createFrameBuilder } = await load("worker/frame_builder.js");

const bytesOf = (text) => Uint8Array.from(Buffer.from(text, "base64"));

async function read({ files, zip }) {
  const named = zip === undefined
    ? new Map(Object.entries(files).map(([name, text]) => {
      const blob = new Blob([bytesOf(text)]);
      return [name, { size: blob.size, open: () => blob.arrayBuffer() }];
    }))
    : await openZip(new Blob([bytesOf(zip)]));
  const source = await sourceOf(named), manifest = await readManifest(source);
  const pixels = await readHeightMap(manifest, source), heights = createHeights(manifest.heights, pixels);
  const builder = createFrameBuilder(structuredClone(manifest), heights);
  await readParts(manifest, source, { take: (index, buffer) => builder.supply.addPart(index, buffer) });
  const place = { x: 1, y: 1, eye: manifest.eye_floor, yaw: 30, pitch: -20 };
  const frame = builder.build(cameraAt(place, 320, 200, heights), 1e6, true);
  return { finite: isFinite(frame, builder), count: frame.count };
}

/** Are all numbers of a frame finite, and all entries Gaussians of chunks that are there? */
function isFinite(frame, builder) {
  const chunks = [...builder.store.all()];
  const sound = chunks.every(({ centres }) => centres.every(Number.isFinite));
  const known = new Set(chunks.flatMap(({ entries }) => [...entries].map((entry) => entry & 0x3fffff)));
  return sound && Number.isFinite(frame.count) && Number.isFinite(frame.reach) && frame.reach > 0
    && frame.near.every((entry) => known.has(entry & 0x3fffff));
}

for await (const line of createInterface({ input: process.stdin })) {
  const start = process.cpuUsage();
  let answer;
  globalThis.gc?.();
  const before = process.memoryUsage();
  try {
    answer = { read: await read(JSON.parse(line)) };
  } catch (error) {
    answer = error instanceof PageError ? { refused: error.message } : { failed: String(error.stack) };
  }
  const spent = process.cpuUsage(start), after = process.memoryUsage();
  answer.seconds = (spent.user + spent.system) / 1e6;
  answer.grown = Math.max(0, after.heapTotal + after.external - before.heapTotal - before.external);
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
