"use strict";

// Reads policy files: npz archives with a JSON header and an array of parameters.

const [END_OF_DIRECTORY, ENTRY] = [0x06054b50, 0x02014b50];
const MOST_BYTES = 2 ** 26;

/** Returns the header, JSON, and the parameters of the bytes of a policy file. */
async function readPolicyFile(bytes) {
  const arrays = await unzip(bytes);
  const header = arrays.get("header.npy");
  const parameters = arrays.get("parameters.npy");
  if (!header || !parameters) throw new Error("expected a policy file (.npz), got another archive");
  return { header: readText(header), parameters: readFloats(parameters) };
}

/** Returns the files of a zip archive by name. */
async function unzip(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let end = bytes.length - 22; // the directory's end record stands last, before a comment
  while (end >= 0 && view.getUint32(end, true) !== END_OF_DIRECTORY) end--;
  if (end < 0) throw new Error("expected a policy file (.npz), got another file");
  const files = new Map();
  let at = view.getUint32(end + 16, true);
  for (let count = view.getUint16(end + 10, true); count > 0; count--) {
    if (view.getUint32(at, true) !== ENTRY) throw new Error("the archive is damaged");
    const number = (offset) => view.getUint32(at + offset, true);
    const length = (offset) => view.getUint16(at + offset, true);
    const [method, size, fullSize, start] = [length(10), number(20), number(24), number(42)];
    if (fullSize > MOST_BYTES) throw new Error("the archive is too large for a policy file");
    const name = new TextDecoder().decode(bytes.subarray(at + 46, at + 46 + length(28)));
    const data = start + 30 + view.getUint16(start + 26, true) + view.getUint16(start + 28, true);
    const packed = bytes.slice(data, data + size);
    const content = method === 0 ? packed : new Uint8Array(await inflate(packed, "deflate-raw"));
    if (crc32(content) !== number(16)) throw new Error("the archive is damaged");
    files.set(name, content);
    at += 46 + length(28) + length(30) + length(32);
  }
  return files;
}

function crc32(bytes) {
  let sum = -1;
  for (const byte of bytes) {
    sum ^= byte;
    for (let bit = 0; bit < 8; bit++) sum = (sum >>> 1) ^ (sum & 1 && 0xedb88320);
  }
  return ~sum >>> 0;
}

/** Returns the type, the shape and the data of an npy file. */
function readArray(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const isShort = bytes[6] === 1; // the version decides the width of the header's length
  const start = isShort ? 10 : 12;
  const end = start + (isShort ? view.getUint16(8, true) : view.getUint32(8, true));
  const header = new TextDecoder().decode(bytes.subarray(start, end));
  const [type, shape] = [/'descr': '([^']+)'/, /'shape': \(([^)]*)\)/].map((field) => field.exec(header)?.[1]);
  return { type, shape, data: bytes.slice(end).buffer };
}

/** Returns the text of an array of one NumPy string, which has four bytes per character. */
function readText(bytes) {
  const { type, data } = readArray(bytes);
  if (!type?.startsWith("<U")) throw new Error(`header: expected text, got ${type}`);
  const codes = [...new Uint32Array(data)].filter((code) => code !== 0);
  return codes.map((code) => String.fromCodePoint(code)).join("");
}

function readFloats(bytes) {
  const { type, shape, data } = readArray(bytes);
  if (!/^\d+,$/.test(shape)) throw new Error(`parameters: expected one dimension, got shape (${shape})`);
  if (type === "<f4") return new Float32Array(data);
  if (type === "<f8") return Float32Array.from(new Float64Array(data));
  throw new Error(`parameters: expected numbers, got ${type}`);
}
