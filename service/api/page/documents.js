// Documents: trees of JSON that are never changed, only replaced along the path of a change.
// So the history keeps complete documents, which share their equal parts.

/** @typedef {(string | number)[]} Path  keys and indices from the root of a document */
/** @typedef {{[key: string]: any}} Surface  a surface as in a request */

/** Why a document cannot be changed as asked, in a sentence. */
export class Unchangeable extends Error {}

/**
 * The value at a path, or undefined if the path leads nowhere.
 * @param {any} root
 * @param {Path} path
 * @returns {any}
 */
export function valueAt(root, path) {
  return path.reduce((value, key) => value?.[key], root);
}

/**
 * The document with another value at a path; it shares all other parts with the old document.
 * @template T
 * @param {T} root
 * @param {Path} path
 * @param {unknown} value
 * @returns {T}
 */
export function replaceValue(root, path, value) {
  return replaceValues(root, [[path, value]]);
}

/**
 * The document with other values at several paths; it shares all other parts with the old document.
 * @template T
 * @param {T} root
 * @param {[Path, unknown][]} changes
 * @returns {T}
 */
export function replaceValues(root, changes) {
  const copies = new Set();
  const copyOnce = (/** @type {any} */ value) => {
    if (copies.has(value)) return value;
    const copy = Array.isArray(value) ? [...value] : { ...value };
    copies.add(copy);
    return copy;
  };
  const holder = { root };
  changes.forEach(([path, value]) => {
    /** @type {any} */
    let node = holder;
    /** @type {string | number} */
    let key = 'root';
    path.forEach((next) => {
      node[key] = copyOnce(node[key]);
      node = node[key];
      key = next;
    });
    node[key] = value;
  });
  return holder.root;
}

/**
 * Whether two values of JSON are equal. Parts that documents share are not looked into.
 * @param {any} a @param {any} b @returns {boolean}
 */
export function isEqual(a, b) {
  if (a === b) return true;
  if (a === null || b === null || typeof a !== 'object' || typeof b !== 'object') return false;
  if (Array.isArray(a) && Array.isArray(b)) {
    return a.length === b.length && a.every((value, i) => isEqual(value, b[i]));
  }
  const [keys, otherKeys] = [Object.keys(a), Object.keys(b)];
  return Array.isArray(a) === Array.isArray(b) && keys.length === otherKeys.length
    && keys.every((key) => Object.hasOwn(b, key) && isEqual(a[key], b[key]));
}

/**
 * A path as a JSON pointer (RFC 6901).
 * @param {Path} path
 */
export function formatPointer(path) {
  return path.map((key) => `/${String(key).replaceAll('~', '~0').replaceAll('/', '~1')}`).join('');
}

/**
 * A JSON pointer as a path; indices stay texts, since keys are compared as texts.
 * @param {string} pointer
 * @returns {string[]}
 */
export function parsePointer(pointer) {
  const keys = pointer.split('/').slice(1);
  return keys.map((key) => key.replaceAll('~1', '/').replaceAll('~0', '~'));
}
