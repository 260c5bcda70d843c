// Sources of a bundle's files: the page's own folder, or files that were dropped onto the page. No more of a file is
// read than the size that is expected. Zip archives come from untrusted sources: entries are read one by one, sizes and
// names are checked before anything is allocated, checksums after. Stored and deflated entries; no zip64.

import { PageError, REMAKE } from "./checks.js";

/**
 * `read(file, size, options)` gives exactly `size` bytes (null: at most MAX_BYTES), or throws a PageError. pauses:
 * milliseconds before it is worth another try.
 *
 * @typedef {{ signal?: AbortSignal, onBytes?: (bytes: number) => void }} ReadOptions
 * @typedef {{ read: (file: string, size: number | null, options?: ReadOptions) => Promise<ArrayBuffer>,
 *   pauses?: number[] }} Source
 *
 * Files by name: their size, and how they are read.
 * @typedef {{ size: number, open: () => Promise<ArrayBuffer> }} FileEntry
 * @typedef {Map<string, FileEntry>} Files
 */

export const MAX_BYTES = 2 ** 26; // of a file whose size nothing says, such as a manifest
export const MAX_FILES = 4096; // in a folder or a zip
const PAUSES = [300, 900, 2700]; // milliseconds

/** @param {string} file */
const shortName = (file) => file.split("/").slice(-2).join("/");

/** Files below a URL. @param {URL} base @returns {Source} */
export function webSource(base) {
  return {
    pauses: PAUSES,
    async read(file, size, { signal, onBytes = () => {} } = {}) {
      const response = await request(new URL(file, base), file, signal), most = size ?? MAX_BYTES;
      const reader = /** @type {ReadableStream<Uint8Array>} */ (response.body).getReader(), parts = [];
      let came = 0;
      for (;;) {
        const { done, value } = await reader.read().catch((error) => {
          throw signal?.aborted ? error : wrongSize(file, came, size ?? came + 1);
        });
        if (done) break;
        came += value.length;
        if (came > most) throw size === null ? tooLarge(file) : wrongSize(file, came, size);
        parts.push(value);
        onBytes(value.length);
      }
      if (size !== null && came < size) throw wrongSize(file, came, size);
      const bytes = new Uint8Array(came);
      for (const part of parts.reverse()) {
        came -= part.length;
        bytes.set(part, came);
      }
      return bytes.buffer;
    },
  };
}

/** Dropped files. @param {Files} files @returns {Source} */
export function fileSource(files) {
  return {
    async read(file, size, { onBytes = () => {} } = {}) {
      const entry = files.get(file);
      if (!entry) {
        throw new PageError(`${shortName(file)} is not among the dropped files. Drop the whole folder, or its zip.`);
      }
      if (size === null && entry.size > MAX_BYTES) throw tooLarge(file);
      if (size !== null && entry.size !== size) throw wrongSize(file, entry.size, size);
      const buffer = await entry.open();
      if (size !== null && buffer.byteLength !== size) throw wrongSize(file, buffer.byteLength, size);
      onBytes(buffer.byteLength);
      return buffer;
    },
  };
}

/**
 * The bytes of a stream, which are exactly `size`: it is stopped at the first one more.
 *
 * @param {ReadableStream<Uint8Array>} stream @param {number} size
 * @param {(what: string) => PageError} broken
 */
export async function readStream(stream, size, broken) {
  const bytes = new Uint8Array(size), reader = stream.getReader();
  let at = 0;
  try {
    for (let step = await reader.read(); !step.done; step = await reader.read()) {
      if (at + step.value.length > size) {
        await reader.cancel();
        throw broken("larger than was promised");
      }
      bytes.set(step.value, at);
      at += step.value.length;
    }
  } catch (error) {
    throw error instanceof PageError ? error : broken("damaged");
  }
  if (at < size) throw broken("cut short");
  return bytes;
}

/** @param {string} file */
export const tooLarge = (file) => new PageError(`${shortName(file)} is too large for what it is. ${REMAKE}`);

/** @param {string} file @param {number} came @param {number} size */
function wrongSize(file, came, size) {
  return new PageError(
    `${file} is ${came < size ? "cut short" : "too long"}: ${came} bytes came, ${size} were promised. `
    + `Reload the page. If that does not help: ${REMAKE}`);
}

/** @param {URL} url @param {string} file @param {AbortSignal} [signal] */
async function request(url, file, signal) {
  let response;
  try {
    response = await fetch(url, { signal, cache: "no-cache" });
  } catch (error) {
    if (signal?.aborted) throw error;
    throw new PageError(`${shortName(file)} cannot be reached. Is “make view” still running?`);
  }
  if (!response.ok) {
    throw new PageError(`${shortName(file)} is not there (the server answered ${response.status}). ${REMAKE}`);
  }
  return response;
}

const END = 0x06054b50, ENTRY = 0x02014b50, LOCAL = 0x04034b50; // signatures of records
const END_SIZE = 22, ENTRY_SIZE = 46, LOCAL_SIZE = 30, MAX_COMMENT = 65535;
const MAX_TABLE = 2 ** 24; // bytes of the table of entries
export const MAX_RATIO = 1032; // bytes that a deflated byte unpacks to, at most
const MAX_UNPACKED = 2 ** 31; // of all entries unpacked

/** @typedef {{ name: string, method: number, crc: number, packed: number, size: number, local: number }} Entry */

/** @param {string} what */
const broken = (what) => new PageError(`The zip cannot be read: ${what}. Make it again, or drop the folder instead.`);

/** Is this a relative path that stays in the archive? @param {string} name */
const isSafe = (name) => name.length < 1024 && !/[\\:]|\p{Cc}/u.test(name) && !name.startsWith("/")
  && name.split("/").every((part) => part !== "" && part !== "." && part !== "..");

/**
 * The entries of an archive, by name; each is unpacked when it is opened. Throws a PageError.
 *
 * @param {Blob} blob
 * @returns {Promise<Files>}
 */
export async function openZip(blob) {
  const tail = await blob.slice(Math.max(0, blob.size - END_SIZE - MAX_COMMENT)).arrayBuffer();
  const view = new DataView(tail);
  let at = tail.byteLength - END_SIZE;
  while (at >= 0 && view.getUint32(at, true) !== END) at -= 1;
  if (at < 0) throw broken("its end is missing, so it was not copied as a whole, or it is no zip");
  const count = view.getUint16(at + 10, true);
  const size = view.getUint32(at + 12, true), begin = view.getUint32(at + 16, true);
  if (count === 0xffff || begin === 0xffffffff) throw broken("it is of the large kind (zip64)");
  if (count > MAX_FILES) throw broken(`it has ${count} entries, at most ${MAX_FILES} are read`);
  if (begin + size > blob.size || size > MAX_TABLE) throw broken("its table lies outside of it, or is too large");
  return readTable(blob, new DataView(await blob.slice(begin, begin + size).arrayBuffer()), count);
}

/** @param {Blob} blob @param {DataView<ArrayBuffer>} table @param {number} count */
function readTable(blob, table, count) {
  /** @type {Files} */
  const files = new Map();
  const decoder = new TextDecoder();
  let at = 0, sum = 0;
  for (let k = 0; k < count; k++) {
    if (at + ENTRY_SIZE > table.byteLength || table.getUint32(at, true) !== ENTRY) throw broken("its table is damaged");
    const [flags, method] = [table.getUint16(at + 8, true), table.getUint16(at + 10, true)];
    const [crc, packed, size] = [16, 20, 24].map((field) => table.getUint32(at + field, true));
    const [long, extra, comment] = [28, 30, 32].map((field) => table.getUint16(at + field, true));
    const local = table.getUint32(at + 42, true), next = at + ENTRY_SIZE + long + extra + comment;
    if (next > table.byteLength) throw broken("its table is damaged");
    const name = decoder.decode(new Uint8Array(table.buffer, table.byteOffset + at + ENTRY_SIZE, long));
    at = next;
    if (name.endsWith("/")) continue;
    if (!isSafe(name)) throw broken(`the name “${name.slice(0, 80).replace(/\p{Cc}/gu, " ")}” leads out of it`);
    if (flags & 1) throw broken(`${name} is locked with a password`);
    if (method !== 0 && method !== 8) throw broken(`${name} is packed in a way (${method}) that browsers do not know`);
    const fits = local + LOCAL_SIZE + packed <= blob.size && (method ? size <= MAX_RATIO * packed : packed === size);
    if (!fits) throw broken(`${name} contradicts its own size`);
    sum += size;
    if (sum > MAX_UNPACKED) throw broken("unpacked it would take more than 2 GB");
    if (files.has(name)) throw broken(`${name} is in it twice`);
    files.set(name, { size, open: () => unpack(blob, { name, method, crc, packed, size, local }) });
  }
  return files;
}

/**
 * The bytes of an entry, with the size and the checksum of the table.
 *
 * @param {Blob} blob @param {Entry} entry
 */
async function unpack(blob, { name, method, crc, packed, size, local }) {
  const head = new DataView(await blob.slice(local, local + LOCAL_SIZE).arrayBuffer());
  if (head.byteLength < LOCAL_SIZE || head.getUint32(0, true) !== LOCAL) {
    throw broken(`${name} is not where the table says`);
  }
  const begin = local + LOCAL_SIZE + head.getUint16(26, true) + head.getUint16(28, true);
  if (begin + packed > blob.size) throw broken(`${name} is cut short`);
  const stored = blob.slice(begin, begin + packed).stream();
  const stream = method === 0 ? stored : stored.pipeThrough(new DecompressionStream("deflate-raw"));
  const bytes = await readStream(stream, size, (what) => broken(`${name} is ${what}`));
  if (crc32(bytes) !== crc) throw broken(`${name} is damaged (its checksum is another)`);
  return bytes.buffer;
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
  return n;
});

/** @param {Uint8Array} bytes */
function crc32(bytes) {
  let crc = -1;
  for (let k = 0; k < bytes.length; k++) crc = CRC_TABLE[(crc ^ bytes[k]) & 255] ^ (crc >>> 8);
  return (crc ^ -1) >>> 0;
}
