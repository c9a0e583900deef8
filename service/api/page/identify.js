// What a file is: known by its first bytes, whatever its name says, and by its suffix.

/** @typedef {import('surface-service').Issue} Issue */

/**
 * What the page knows about files, as the service wrote it into the page.
 * @typedef {object} Facts
 * @property {{media_type: string, suffixes: string[], beginning: string | null}[]} read  formats that the
 *   service reads; `beginning` is a regular expression of the first bytes, as a text of Latin-1
 * @property {{suffixes: string[], beginning: string | null, issue: Issue}[]} refused  formats that it does not
 *   read, and what to send in their place; of two that fit, the first counts
 * @property {{format: string, suffixes: string[], beginning: string | null}[]} meshes  formats
 *   of meshes that can be checked against a surface
 * @property {number} max_bytes  of a file
 * @property {number} max_json_bytes  of a file in JSON
 */

/** @typedef {{json: true} | {mediaType: string} | {issue: Issue}} Identity  how to read a file, or why not */

/** The bytes of a file by which it is known. */
export const START_BYTES = 4096;

/** How JSON of surfaces begins. */
const JSON_START = /^(?:\xef\xbb\xbf)?\s*[[{]/;

/**
 * How to read a file, by its name and its first bytes.
 * @param {string} name  empty for a text @param {string} start  the first bytes, as a text of Latin-1
 * @param {Facts} facts @returns {Identity}
 */
export function identify(name, start, { read, refused }) {
  const { suffix, begins, hasSuffix } = matchersOf(name, start);
  const refusedStart = refused.find(begins);
  if (!refusedStart) {
    const known = read.find(begins);
    if (known) return { mediaType: known.media_type };
    const named = read.find(hasSuffix);
    // Texts of any content have the suffix of the teapot's.
    if (named && !(suffix === 'txt' && JSON_START.test(start))) return { mediaType: named.media_type };
  }
  // The suffix says more than the beginning of an archive, which files of many programs are.
  const known = refused.find(hasSuffix) ?? refusedStart;
  if (known) return { issue: known.issue };
  if (name === '' || suffix === 'json' || suffix === 'txt' || JSON_START.test(start)) return { json: true };
  const suffixes = ['json', ...read.flatMap((each) => each.suffixes)].map((each) => `.${each}`);
  const detail = 'Neither the name nor the content of this file says what it is.';
  return { issue: { code: 'format_not_read', detail, needed: `a file of one of these: ${suffixes.join(', ')}` } };
}

/**
 * The format of a file with a mesh; null for a file that is none. An OBJ file may also have surfaces.
 * @param {string} name @param {string} start  as of `identify`
 * @param {Facts} facts @returns {Facts['meshes'][number] | null}
 */
export function identifyMesh(name, start, { meshes, read, refused }) {
  const { suffix, begins, hasSuffix } = matchersOf(name, start);
  const begun = meshes.find(begins);
  const named = meshes.find(hasSuffix);
  // A file with a mesh and a wrong suffix is a mesh, but JSON of surfaces has many forms.
  if (named === undefined) {
    return read.some(hasSuffix) || read.some(begins) || suffix === 'json' || JSON_START.test(start) ? null : begun ?? null;
  }
  if (begun === undefined && (read.some(begins) || refused.some(begins))) return null;
  return begun ?? named;
}

/** How to compare a file with formats. @param {string} name @param {string} start */
function matchersOf(name, start) {
  const suffix = suffixOf(name);
  return {
    suffix,
    begins: (/** @type {{beginning: string | null}} */ { beginning }) => (
      beginning !== null && new RegExp(`^(?:${beginning})`, 's').test(start)
    ),
    hasSuffix: (/** @type {{suffixes: string[]}} */ { suffixes }) => suffixes.includes(suffix),
  };
}

/** The suffix of a file, without the dot, in lower case; empty if it has none. @param {string} name */
export function suffixOf(name) {
  return /\.([^./\\]+)$/.exec(name)?.[1].toLowerCase() ?? '';
}

/** The name of a file without folders and suffix. @param {string} name */
export function stemOf(name) {
  return (name.split(/[/\\]/).pop() ?? '').replace(/\.[^.]+$/, '');
}
