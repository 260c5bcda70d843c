// Zip archives from untrusted sources: entries are read from the file one by one, sizes and names are checked before
// anything is allocated, checksums after. Stored and deflated entries; no zip64.

import { PageError } from "./checks.js";
import { MAX_FILES, readStream } from "./source.js";

const END = 0x06054b50, ENTRY = 0x02014b50, LOCAL = 0x04034b50; // signatures of records
const END_SIZE = 22, ENTRY_SIZE = 46, LOCAL_SIZE = 30, MAX_COMMENT = 65535;
const MAX_TABLE = 2 ** 24; // bytes of the table of entries
export const MAX_RATIO = 1032; // bytes that a deflated byte unpacks to, at most
const MAX_BYTES = 2 ** 31; // of all entries unpacked

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
 * @returns {Promise<import("./source.js").Files>}
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
  /** @type {import("./source.js").Files} */
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
    if (sum > MAX_BYTES) throw broken("unpacked it would take more than 2 GB");
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
