// The differences between two documents, as small as the edit that was made.

import { isEqual, replaceValue, valueAt } from './documents.js';

/** @typedef {import('./documents.js').Path} Path */

/**
 * One change at a path: the value there is removed; replaced; or a number of its items, from an index on,
 * are replaced by others.
 * @typedef {[Path] | [Path, any] | [Path, number, number, any[]]} Change
 */

/** The changes that make `to` from `from`. @param {any} from @param {any} to @param {Path} path @returns {Change[]} */
export function listChanges(from, to, path = []) {
  if (from === to) return [];
  if (Array.isArray(from) && Array.isArray(to)) return listItemChanges(from, to, path);
  if (!isObject(from) || !isObject(to)) return [[path, to]];
  /** @type {Change[]} */
  const changes = Object.keys(from).filter((key) => !Object.hasOwn(to, key)).map((key) => [[...path, key]]);
  Object.keys(to).forEach((key) => {
    if (Object.hasOwn(from, key)) changes.push(...listChanges(from[key], to[key], [...path, key]));
    else changes.push([[...path, key], to[key]]);
  });
  return changes;
}

/** @param {any[]} from @param {any[]} to @param {Path} path @returns {Change[]} */
function listItemChanges(from, to, path) {
  if (from.length !== to.length) {
    const shorter = Math.min(from.length, to.length);
    let start = 0;
    while (start < shorter && isEqual(from[start], to[start])) start += 1;
    let end = 0;
    while (end < shorter - start && isEqual(from.at(-1 - end), to.at(-1 - end))) end += 1;
    return [[path, start, from.length - end - start, to.slice(start, to.length - end)]];
  }
  /** @type {Change[]} */
  const changes = [];
  for (let i = 0; i < to.length; i += 1) {
    if (from[i] !== to[i]) changes.push(...listChanges(from[i], to[i], [...path, i]));
    // More changes than items are longer than the array itself.
    if (changes.length > to.length) return [[path, to]];
  }
  return changes;
}

/** @template T @param {T} root @param {Change[]} changes @returns {T} */
export function applyChanges(root, changes) {
  return changes.reduce((document, change) => {
    const [path] = change;
    if (change.length === 1) return removeValue(document, path);
    if (change.length === 2) return replaceValue(document, path, change[1]);
    const [, start, count, items] = change;
    const array = valueAt(document, path);
    return replaceValue(document, path, [...array.slice(0, start), ...items, ...array.slice(start + count)]);
  }, root);
}

/** @template T @param {T} root @param {Path} path @returns {T} */
function removeValue(root, path) {
  const parent = path.slice(0, -1);
  const { [/** @type {string} */ (path.at(-1))]: _, ...rest } = valueAt(root, parent);
  return replaceValue(root, parent, rest);
}

/** @param {any} value */
const isObject = (value) => value !== null && typeof value === 'object' && !Array.isArray(value);
