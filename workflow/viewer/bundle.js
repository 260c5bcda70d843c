// The bundle: davgswt.json, checked before anything is drawn, and its chunks, fetched coarse level first.

import { RECORD, indexType, sizeOf, sound } from "./encoding.js";

const FORMAT = "davgswt", VERSION = 2;
const AT_ONCE = 6; // requests under way
const AGAIN = "Make the page again with “make run”.";

/** What went wrong, in words for the person at the screen: what happened, and what to do. */
export class PageError extends Error {}

/** Fetch and check the manifest. Raises: PageError. */
export async function readManifest(url, signal) {
  const response = await get(url, signal);
  let manifest;
  try {
    manifest = await response.json();
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new PageError(`${name(url)} is not readable as JSON (${error.message}). ${AGAIN}`);
  }
  const fault = faultOf(manifest);
  if (fault) throw new PageError(`${name(url)}: ${fault}`);
  return manifest;
}

/** Why a manifest cannot be used, or null. */
export function faultOf(m) {
  if (m === null || typeof m !== "object" || m.format !== FORMAT) {
    return `this is not a terrain (format “${m?.format}”, “${FORMAT}” is needed).`;
  }
  if (m.version !== VERSION) {
    return `the terrain has version ${m.version}, this page reads version ${VERSION}. ${AGAIN}`;
  }
  const broken = (what) => `“${what}” is missing or makes no sense. ${AGAIN}`;
  if (!positive(m.tile_side)) return broken("tile_side");
  if (!positive(m.eye_floor)) return broken("eye_floor");
  if (!Number.isInteger(m.salt) || m.salt < 0 || m.salt > 0xffffffff) return broken("salt");
  if (!vector(m.ground_colour)) return broken("ground_colour");
  if (!vector(m.sky?.zenith) || !vector(m.sky?.horizon)) return broken("sky");
  if (!sound(m.encoding)) return broken("encoding");
  if (!filled(m.directions) || !m.directions.every(vector)) return broken("directions");
  const levels = m.levels;
  if (!filled(levels) || !levels.every((level, l) => level?.level === l && rises(levels, l))) return broken("levels");
  if (!filled(m.tiles) || m.tiles.length % 16) return broken("tiles");
  return m.tiles.map((tile, t) => tileFault(m, tile, t)).find((fault) => fault) ?? null;
}

function tileFault(m, tile, t) {
  const heights = Array.isArray(tile?.z) && tile.z.length === 2 && tile.z.every(Number.isFinite);
  if (tile?.tile !== t || !heights || !Array.isArray(tile.chunks)) {
    return `tile ${t} is missing or makes no sense. ${AGAIN}`;
  }
  const levels = new Set(tile.chunks.map((chunk) => chunk?.level));
  if (levels.size !== m.levels.length || tile.chunks.length !== m.levels.length) {
    return `tile ${t} does not have one chunk for each of ${m.levels.length} levels. ${AGAIN}`;
  }
  for (const chunk of tile.chunks) {
    const fits = natural(chunk.level) && chunk.level < m.levels.length && natural(chunk.count) && filled(chunk.orders)
      && chunk.orders.every((d) => natural(d) && d < m.directions.length)
      && chunk.bytes === sizeOf(chunk.count, chunk.orders.length) && inside(chunk.file);
    if (!fits) return `the entry of chunk “${chunk.file}” contradicts itself. ${AGAIN}`;
  }
  return null;
}

const natural = (x) => Number.isInteger(x) && x >= 0;
const positive = (x) => Number.isFinite(x) && x > 0;
const filled = (list) => Array.isArray(list) && list.length > 0;
const vector = (v) => Array.isArray(v) && v.length === 3 && v.every(Number.isFinite);
const inside = (file) => typeof file === "string" && /^[\w-][\w.-]*(\/[\w-][\w.-]*)*$/.test(file);

function rises(levels, l) {
  const far = levels[l].distance;
  if (l === levels.length - 1) return far === null;
  return Number.isFinite(far) && far >= (l ? levels[l - 1].distance : 0);
}

/**
 * Fetch all chunks, the coarsest level first, and hand each to `take` as it arrives.
 *
 * onProgress({bytes, total, chunks, of}) follows the bytes. The first failure stops all other requests and is thrown.
 */
export async function readChunks(manifest, base, { take, onProgress, signal }) {
  const queue = manifest.tiles.flatMap((tile) => tile.chunks.map((entry) => ({ tile: tile.tile, entry })));
  queue.sort((a, b) => b.entry.level - a.entry.level || a.tile - b.tile);
  const total = queue.reduce((sum, { entry }) => sum + entry.bytes, 0);
  const progress = { bytes: 0, total, chunks: 0, of: queue.length };
  const stop = new AbortController();
  signal?.addEventListener("abort", () => stop.abort(signal.reason), { once: true });
  let next = 0;
  const worker = async () => {
    while (next < queue.length) {
      const { tile, entry } = queue[next++];
      const buffer = await readChunk(entry, base, stop.signal, (bytes) => {
        progress.bytes += bytes;
        onProgress(progress);
      });
      stop.signal.throwIfAborted();
      take({ tile, level: entry.level, ...parts(buffer, entry) });
      progress.chunks += 1;
      onProgress(progress);
    }
  };
  let first = null;
  const guarded = () => worker().catch((error) => {
    first ??= error;
    stop.abort();
  });
  await Promise.all(Array.from({ length: AT_ONCE }, guarded));
  if (first) throw first;
}

/** A chunk's records and orders: views of its bytes, nothing is copied. */
function parts(buffer, entry) {
  const records = new Uint32Array(buffer, 0, (entry.count * RECORD) / 4);
  const orders = new (indexType(entry.count))(buffer, entry.count * RECORD);
  return { count: entry.count, directions: entry.orders, records, orders };
}

async function readChunk(entry, base, signal, onBytes) {
  const url = new URL(entry.file, base);
  const response = await get(url, signal);
  const bytes = new Uint8Array(entry.bytes);
  const short = (at) => new PageError(
    `${entry.file} is ${at < entry.bytes ? "cut short" : "too long"}: ${at} bytes came, ${entry.bytes} were promised. `
    + `Reload the page. If that does not help: ${AGAIN}`);
  let at = 0;
  const reader = response.body.getReader();
  for (;;) {
    let step;
    try {
      step = await reader.read();
    } catch (error) {
      throw signal.aborted ? error : short(at); // the connection broke off
    }
    if (step.done) break;
    if (at + step.value.length > bytes.length) throw short(at + step.value.length);
    bytes.set(step.value, at);
    at += step.value.length;
    onBytes(step.value.length);
  }
  if (at < bytes.length) throw short(at);
  await checkDigest(bytes, entry);
  return bytes.buffer;
}

/** Compare with the manifest's SHA-256 where the browser offers it (https, or this machine's own address). */
async function checkDigest(bytes, entry) {
  if (!globalThis.crypto?.subtle || typeof entry.sha256 !== "string") return;
  const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", bytes));
  const text = Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("");
  if (text !== entry.sha256.toLowerCase()) {
    throw new PageError(
      `${entry.file} is damaged (its SHA-256 is not the manifest's). Reload the page. If that does not help: ${AGAIN}`);
  }
}

async function get(url, signal) {
  let response;
  try {
    response = await fetch(url, { signal, cache: "no-cache" });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new PageError(`${name(url)} cannot be reached. Is “make view” still running?`);
  }
  if (!response.ok) {
    throw new PageError(`${name(url)} is not there (the server answered ${response.status}). ${AGAIN}`);
  }
  return response;
}

const name = (url) => new URL(url, "http://page/").pathname.split("/").slice(-2).join("/").replace(/^\//, "");
