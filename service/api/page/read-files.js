// Reads the files and texts that a person opens: JSON here, all others by the service. Several become one
// group.

import { ServiceError } from 'surface-service';
import { MAX_FILES } from './drops.js';
import { identify, identifyMesh, START_BYTES, stemOf } from './identify.js';
import { joinSurfaces } from './join.js';
import { takeOptions } from './request-options.js';
import { chooseKind, parseRequest } from './requests.js';
import { client } from './service.js';
import { Unreadable } from './unreadable.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./identify.js').Facts} Facts */
/** @typedef {import('surface-service').Reading} Reading */
/** @typedef {import('./settings.js').Settings} Settings */

/** A file, or a text without a name. @typedef {{name: string, content: Blob}} Source */

/**
 * A surface that was read, with the settings that its request asks for, and what there is to say about it.
 * @typedef {{surface: Surface, settings: Partial<Settings>, title: string, description: string}} Read
 */

/** The most faces whose reason a description has, and the most files that it names. */
const MAX_REASONS = 3;
const MAX_NAME = 100;

/**
 * The surface in files: of several, a group with a member for each. Files that cannot be read are left
 * out, and the description names them; throws if none can be read.
 * @param {Source[]} sources @param {Facts} facts @param {AbortSignal} signal @param {(detail: string) => void} tell
 * @returns {Promise<Read>}
 */
export async function readSources(sources, facts, signal, tell) {
  if (sources.length > MAX_FILES) {
    const detail = 'These are more files than the page opens at once.';
    throw new Unreadable({ code: 'too_many_files', detail, needed: `at most ${MAX_FILES}` });
  }
  /** @type {{name: string, read: Read}[]} */
  const done = [];
  /** @type {{name: string, error: Error}[]} */
  const failures = [];
  for (const [index, source] of sources.entries()) {
    if (sources.length > 1) tell(`${index + 1} of ${sources.length}: ${source.name}`);
    try {
      done.push({ name: source.name, read: await readSource(source, facts, signal) });
    } catch (error) {
      const isOfFile = error instanceof Unreadable || error instanceof ServiceError;
      if (!isOfFile || sources.length === 1) throw error;
      failures.push({ name: source.name, error });
    }
  }
  if (done.length === 0) throw failures[0].error;
  const notOpened = failures.map(({ name, error }) => `Not opened: ${name} (${reasonOf(error)}).`).join(' ');
  const read = done.length === 1 ? done[0].read : joinReads(done);
  return { ...read, description: [read.description, notOpened].filter(Boolean).join(' ') };
}

/**
 * A file with a mesh, the name of its format, and the limits of files and of JSON.
 * @typedef {{name: string, content: Blob, format: string, maxBytes: number, maxJsonBytes: number}} MeshFile
 */

/**
 * The mesh in a file; null if the file is to be read as a surface: also if it has both.
 * @param {Source} source @param {Facts} facts @returns {Promise<MeshFile | null>}
 */
export async function findMesh({ name, content }, facts) {
  const mesh = identifyMesh(name, latin1(await bytesOf(content.slice(0, START_BYTES))), facts);
  if (mesh === null) return null;
  if (mesh.format === 'obj' && /^[ \t]*surf\s/m.test(await content.text())) return null;
  const { max_bytes: maxBytes, max_json_bytes: maxJsonBytes } = facts;
  return { name, content, format: mesh.format, maxBytes, maxJsonBytes };
}

/** @param {{name: string, read: Read}[]} done @returns {Read} */
function joinReads(done) {
  const surface = joinSurfaces(done.map(({ name, read }) => ({ name: cleanName(stemOf(name)), surface: read.surface })));
  const names = done.slice(0, MAX_REASONS).map(({ name }) => name);
  const rest = done.length > MAX_REASONS ? ', …' : '';
  const settings = done.map(({ read }) => read.settings).find((each) => Object.keys(each).length > 0) ?? {};
  return {
    surface, settings, title: `${done.length} files`, description: `A group of your files: ${names.join(', ')}${rest}.`,
  };
}

/** @param {Source} source @param {Facts} facts @param {AbortSignal} signal @returns {Promise<Read>} */
async function readSource({ name, content }, facts, signal) {
  if (content.size === 0) {
    throw new Unreadable({ code: 'empty_body', detail: 'The file is empty.', needed: 'a file with a surface' });
  }
  const start = latin1(await bytesOf(content.slice(0, START_BYTES)));
  const identity = identify(name, start, facts);
  if ('issue' in identity) throw new Unreadable(identity.issue);
  const isJson = 'json' in identity;
  checkSize(content.size, isJson ? facts.max_json_bytes : facts.max_bytes);
  if (isJson) return describe(name, new TextDecoder().decode(await bytesOf(content)));
  const file = { file: content, mediaType: identity.mediaType, ...chooseOptions(start) };
  const { surface, reading } = await client.convert(file, {}, { signal });
  const note = reading ? describeReading(reading) : 'A file of yours, read by the service.';
  return { surface, settings: {}, title: name || titleOf(surface), description: note };
}

/** The surface in a text that is JSON. @param {string} name  of its file, or empty @param {string} text @returns {Read} */
function describe(name, text) {
  const { surface, options, note } = parseRequest(text);
  const { settings, note: about } = takeOptions(options, surface);
  const source = name ? `A surface of yours, from ${name}.` : 'A surface of yours.';
  const title = titleOf(surface) || stemOf(name) || 'Untitled surface';
  return { surface, settings, title, description: [source, note, about].filter(Boolean).join(' ') };
}

/** The fields of the surface to ask for beside a file: of an array of NumPy with one large net, a B-spline. @param {string} start @returns {{type?: 'bspline', degree?: [number, number]}} */
function chooseOptions(start) {
  const shape = start.startsWith('\x93NUMPY') ? /'shape': *\((\d+), *(\d+), *[34],? *\)/.exec(start) : null;
  return (shape && chooseKind([Number(shape[1]), Number(shape[2])])) ?? {};
}

/** @param {number} size @param {number} most @param {string} [remedy]  after the most bytes */
export function checkSize(size, most, remedy = 'several files can be opened as one group') {
  if (size <= most) return;
  const megabytes = (/** @type {number} */ bytes) => `${(bytes / 1e6).toFixed(1)} MB`;
  throw new Unreadable({
    code: 'body_too_large',
    detail: 'The file is larger than this service accepts.',
    got: megabytes(size),
    needed: `at most ${megabytes(most)}; ${remedy}`,
  });
}

/** @param {Blob} content */
async function bytesOf(content) {
  try {
    return new Uint8Array(await content.arrayBuffer());
  } catch {
    const detail = 'The browser cannot read the file: it was moved or changed, or may not be read.';
    throw new Unreadable({ code: 'malformed_body', detail });
  }
}

/** @param {Uint8Array} bytes */
function latin1(bytes) {
  return String.fromCharCode(...bytes);
}

/** @param {Error} error */
function reasonOf(error) {
  const issues = error instanceof Unreadable || error instanceof ServiceError ? error.errors : [];
  return (issues[0]?.detail ?? error.message).replace(/\.$/, '');
}

/** @param {Surface} surface */
function titleOf(surface) {
  return typeof surface.name === 'string' ? surface.name : '';
}

/** A name without control characters. @param {string} name */
function cleanName(name) {
  return name.replace(/[\x00-\x1f\x7f-\x9f\u2028\u2029]/g, ' ').slice(0, MAX_NAME).trim() || 'surface';
}

/** What was read from a CAD file, in words: also which faces were not. @param {Reading} reading */
function describeReading({ faces, skipped_faces: skipped }) {
  const read = `A file of yours, read by the service: ${faces} ${faces === 1 ? 'face' : 'faces'}.`;
  if (skipped.length === 0) return read;
  const reasons = skipped.slice(0, MAX_REASONS).map(({ entity, reason }) => `${entity}: ${reason}`);
  const rest = skipped.length > MAX_REASONS ? '; …' : '';
  return `${read} Not in the surface: ${skipped.length} more (${reasons.join('; ')}${rest}).`;
}
