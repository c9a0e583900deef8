// The options of a request that a person opens: the page takes those over for which it has a control.

import { netOf, pointAt } from './net.js';
import { RANGES, relativeTolerance } from './settings.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./settings.js').Settings} Settings */

/** Fields of responses beside a surface, which ask for nothing. */
const ANSWERS = new Set(['id', 'links', 'title', 'description', 'reading', 'orientation', 'engine', 'bounds']);

/**
 * The settings that options ask for, and a sentence about those that the page cannot take over.
 * @param {{[name: string]: unknown}} options @param {Surface} surface
 * @returns {{settings: Partial<Settings>, note: string}}
 */
export function takeOptions(options, surface) {
  const { resolution, relative_tolerance: relative, tolerance, ...others } = options;
  /** @type {Partial<Settings>} */
  const settings = {};
  /** @type {string[]} */
  const notes = [];
  const left = Object.keys(others).filter((name) => !ANSWERS.has(name));
  const divisions = [resolution].flat().filter((value) => typeof value === 'number');
  if (divisions.length > 0) {
    const value = Math.max(...divisions);
    settings.accuracy = 'resolution';
    settings.resolution = Math.round(within(value, RANGES.resolution));
    if (divisions.some((each) => each !== settings.resolution)) {
      notes.push(`Resolution ${settings.resolution} in place of ${divisions.join(' × ')}.`);
    }
  }
  const diagonal = measureDiagonal(surface);
  const share = typeof relative === 'number' ? relative : Number(tolerance) / diagonal;
  if (share > 0 && Number.isFinite(share)) {
    settings.accuracy = 'tolerance';
    settings.tolerance = within(Math.log10(share), RANGES.tolerance);
    const taken = relativeTolerance({ tolerance: settings.tolerance });
    if (taken !== share) notes.push(`The tolerance is ${Number((100 * taken).toPrecision(3))} % of the diagonal.`);
  } else if (tolerance !== undefined) left.push('tolerance');
  if (left.length > 0) notes.push(`The page has no control for ${left.map((name) => `"${name}"`).join(', ')}.`);
  return { settings, note: notes.join(' ') };
}

/** The diagonal of the box about all control points; NaN without any. @param {Surface} surface */
function measureDiagonal(surface) {
  const { handles, frames } = netOf(surface);
  const [low, high] = [[Infinity, Infinity, Infinity], [-Infinity, -Infinity, -Infinity]];
  handles.forEach((handle) => {
    const [x, y, z = 0] = pointAt(surface, handle);
    const m = frames[handle.frame];
    for (let k = 0; k < 3; k += 1) {
      const value = m[4 * k] * x + m[4 * k + 1] * y + m[4 * k + 2] * z + m[4 * k + 3];
      low[k] = Math.min(low[k], value);
      high[k] = Math.max(high[k], value);
    }
  });
  return handles.length > 0 ? Math.hypot(...low.map((value, k) => high[k] - value)) : NaN;
}

/** @param {number} value @param {number[]} range */
function within(value, [low, high]) {
  return Math.min(high, Math.max(low, value));
}
