// The address of the page: which surface is open, in the query, and how it is shown, in the fragment.
//
//   ?surface=saddle#resolution=6&look=mean&camera=1,2,3,0,0,0
//
// `surface` is the name of an example or the id of a stored surface; an edited or unsaved surface has
// none. The fragment has the settings (`toQuery` in settings.js) and the camera: its position and the point
// it looks at, in the coordinates of glTF. What is missing or invalid gets its default. Options in the
// query, as in links of earlier versions, are read if there is no fragment.

import { fromQuery, toQuery } from './settings.js';

/** @typedef {import('./settings.js').Settings} Settings */

/** `camera`: x, y, z of the position, and of the target; null for the default view.
 * @typedef {{surface: string, settings: Settings, camera: number[] | null}} Address */

/** A longer fragment is not read. */
const MAX_LENGTH = 2000;
/** The largest coordinate of a camera. */
const MAX_COORDINATE = 1e12;
const NUMBER = /^-?\d{1,20}(\.\d{1,20})?(e[+-]?\d{1,2})?$/;

/** @param {{search: string, hash: string}} location @returns {Address} */
export function readAddress({ search, hash }) {
  const query = new URLSearchParams(search);
  const fragment = readFragment(hash);
  const options = fragment.toString() === '' ? query : fragment;
  return {
    surface: query.get('surface') ?? '',
    settings: fromQuery(options),
    camera: readCamera(options.get('camera')),
  };
}

/** The pairs of a fragment that have the form `name=value`; no pair if another part has another form. @param {string} hash */
function readFragment(hash) {
  const text = hash.replace(/^#/, '');
  const isValid = text.length <= MAX_LENGTH && text.split('&').every((pair) => /^[a-z_]+=[^=]*$/.test(pair));
  return new URLSearchParams(isValid ? text : '');
}

/** @param {string | null} text @returns {number[] | null} */
function readCamera(text) {
  const parts = (text ?? '').split(',');
  if (parts.length !== 6 || !parts.every((part) => NUMBER.test(part))) return null;
  const numbers = parts.map(Number);
  if (!numbers.every((number) => Math.abs(number) <= MAX_COORDINATE)) return null;
  const isSomewhereElse = [0, 1, 2].some((i) => numbers[i] !== numbers[i + 3]);
  return isSomewhereElse ? numbers : null;
}

/** The query and the fragment of an address; empty for the default of everything. @param {Address} address */
export function formatAddress({ surface, settings, camera }) {
  const query = surface === '' ? '' : `?${new URLSearchParams({ surface })}`;
  const options = toQuery(settings);
  if (camera !== null) options.set('camera', formatCamera(camera));
  // A comma needs no escape in a fragment.
  const fragment = options.toString().replaceAll('%2C', ',');
  return query + (fragment && `#${fragment}`);
}

/** Coordinates of a camera with as many digits as a person sees. @param {number[]} camera */
export function formatCamera(camera) {
  return camera.map((value) => String(Number(value.toPrecision(6)))).join(',');
}
