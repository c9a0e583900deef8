// Which surface of a document a change is about, why it cannot be changed, and how the result of the
// service becomes one step of the history.

import { replaceValues, valueAt } from './documents.js';
import { baseOf, pointAt } from './net.js';
import { perform } from './work.js';

/** @typedef {import('./documents.js').Path} Path */
/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./selection.js').Direction} Direction */
/** @typedef {import('./state.js').State} State */

/**
 * A changed surface, what has happened in words, and the row to choose along the direction.
 * @typedef {{surface: Surface, message: string, line?: number}} Outcome
 */

/** @typedef {'rows' | 'degree' | 'knots' | 'mirror'} Change */

const HOMOGENEOUS = 'The control points are homogeneous, (w x, w y, w z, w), and have no places to drag.';
const PATCHES = 'Patches share their points, so no row can be added to one of them; the degree of all can be raised.';
const TRIANGLE = 'A triangle has no rows, columns or knots; its degree can be raised.';
const CURVE = 'This surface follows a curve, and has no rows, columns, knots or degree of its own.';
const PART = 'A part has no control net of its own. POST /v1/convert with “untrim” takes out the surface of a face.';
const SEVERAL = 'Choose a control point first: it says which of the surfaces is changed.';

/** Why kinds of surfaces cannot be changed. @type {{[type: string]: {[change in Change]?: string}}} */
const REASONS = {
  triangle: { rows: TRIANGLE, knots: TRIANGLE },
  patches: { rows: PATCHES, knots: PATCHES },
  tube: { rows: CURVE, degree: CURVE, knots: CURVE },
  ribbon: { rows: CURVE, degree: CURVE, knots: CURVE },
  brep: { rows: PART, degree: PART, knots: PART, mirror: PART },
  group: { rows: SEVERAL, degree: SEVERAL, knots: SEVERAL },
  multipatch: { rows: SEVERAL, degree: SEVERAL, knots: SEVERAL },
};

/** The surface that has the chosen point, or else the document; with its path. @param {State} state */
function findTarget({ surface, handle }) {
  const path = handle ? baseOf(handle) : [];
  return { path, surface: /** @type {Surface} */ (valueAt(surface, path)) };
}

/** Why the open surface cannot be changed in a way; empty if it can. @param {State} state @param {Change} change */
export function explainRefusal(state, change) {
  const { surface } = findTarget(state);
  const reason = REASONS[surface.type ?? 'bezier']?.[change];
  if (reason !== undefined) return reason;
  if (change === 'mirror') return '';
  if (isHomogeneous(surface)) return HOMOGENEOUS;
  return change === 'rows' && !state.handle ? 'Choose a control point: rows and columns are added and removed at it.' : '';
}

/** Whether a document has homogeneous control points. @param {Surface} surface @returns {boolean} */
export function isHomogeneous(surface) {
  const inner = [surface.curve, ...(surface.surfaces ?? []), ...(surface.definitions ?? []),
    ...(surface.members ?? []).map((/** @type {any} */ member) => member?.surface)];
  return surface.homogeneous === true || inner.some((each) => each && isHomogeneous(each));
}

/**
 * Changes the surface that has the chosen point. Then chooses the point with the same number in the row that
 * the outcome names, or else the nearest point.
 * @param {State} state @param {Direction} direction @param {string} what  in words, for the bar
 * @param {(surface: Surface, line: number, signal: AbortSignal) => Promise<Outcome>} act
 */
export async function change(state, direction, what, act) {
  const { path, surface } = findTarget(state);
  const indices = state.handle?.indices ?? [0, 0];
  const start = state.point();
  /** @type {number | undefined} */
  let line;
  const message = await replace(state, what, async (signal) => {
    const outcome = await act(surface, Number(indices[direction] ?? 0), signal);
    line = outcome.line;
    return { ...outcome, surface: replaceValues(state.surface, [[path, outcome.surface]]) };
  });
  if (start) state.choose(findPoint(state, path, start, line === undefined ? null : indices.with(direction, line)));
  return message;
}

/**
 * The point of a surface with these indices; without indices, the one that is nearest to a place.
 * @param {State} state @param {Path} path  of the surface @param {number[]} place @param {Path | null} indices
 */
function findPoint({ net, surface }, path, place, indices) {
  const key = path.join();
  let [best, least] = [-1, Infinity];
  net.handles.forEach((handle, i) => {
    if (baseOf(handle).join() !== key) return;
    const distance = indices === null
      ? Math.hypot(...pointAt(surface, handle).map((value, axis) => value - (place[axis] ?? 0)))
      : Number(handle.indices.join() !== indices.join());
    if (distance < least) [best, least] = [i, distance];
  });
  return best;
}

/**
 * Replaces the document by an outcome; returns its message. If the document changes meanwhile, the
 * outcome is dropped.
 * @param {State} state @param {string} what @param {(signal: AbortSignal) => Promise<Outcome>} act
 */
export async function replace(state, what, act) {
  state.commit();
  const outdated = new AbortController();
  const stop = state.listen((kind) => {
    if (kind !== 'settings' && kind !== 'chosen') outdated.abort();
  });
  try {
    const { surface, message } = await perform(what, act, outdated.signal);
    stop();
    state.change(surface, true);
    return message;
  } finally {
    stop();
  }
}
