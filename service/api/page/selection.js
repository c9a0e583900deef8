// Several control points at once: which points form a row or a column, and how a document changes if
// points move together, get one weight, or are mirrored. Numbers of points are those of a `Net`.

import { replaceValues, valueAt } from './documents.js';
import { baseOf, buildWeights, netAt, pointAt } from './net.js';

/** @typedef {import('./documents.js').Path} Path */
/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./net.js').Net} Net */

/** @typedef {0 | 1} Direction  0: along u; 1: along v. A row of a net runs along v, a column along u. */

/** How the lines of points are called that are added along u, and along v. */
export const LINES = /** @type {const} */ (['row', 'column']);

/** Digits to which sums of coordinates are rounded, so that 0.1 + 0.2 is 0.3. */
const DIGITS = 15;

/** Whether a point is in a row: vertices of patches are not. @param {import('./net.js').Handle} handle */
export function hasLines({ indices, point }) {
  return indices.length > 1 || !point.includes('vertices');
}

/**
 * The points in the row (`direction` 0) or the column (1) of a point. A curve is one row; vertices of
 * patches have no rows, so their list is empty.
 * @param {Net} net @param {number} index @param {Direction} direction @returns {number[]}
 */
export function lineOf(net, index, direction) {
  const { indices, frame } = net.handles[index];
  if (!hasLines(net.handles[index])) return [];
  if (indices.length === 1) return pointsOf(net, index);
  const line = indices[direction];
  return pointsOf(net, index).filter((i) => (
    net.handles[i].indices[direction] === line && net.handles[i].frame === frame
  ));
}

/** All points of the surface that has a point. @param {Net} net @param {number} index */
function pointsOf(net, index) {
  const base = baseOf(net.handles[index]).join();
  return net.handles.flatMap((handle, i) => (baseOf(handle).join() === base ? [i] : []));
}

/**
 * The document after the last point of a selection has moved to a place, and the others as far in the
 * scene: so they keep their distances, also in surfaces of a group that are turned or scaled. `begin` is
 * the document before the move.
 * @param {Surface} surface @param {Net} net @param {number[]} selection @param {number[]} place
 * @param {Surface} begin
 * @returns {Surface}
 */
export function moveTogether(surface, net, selection, place, begin = surface) {
  const last = selection[selection.length - 1];
  const leader = net.handles[last];
  const start = pointAt(begin, leader);
  const offset = [0, 1, 2].map((axis) => (place[axis] ?? 0) - (start[axis] ?? 0));
  /** Offsets in the coordinates of each surface. @type {Map<number, number[]>} */
  const offsets = new Map([[leader.frame, offset]]);
  const offsetIn = (/** @type {number} */ frame) => {
    const known = offsets.get(frame);
    if (known !== undefined) return known;
    const found = solve(linearPart(net.frames[frame]), apply(linearPart(net.frames[leader.frame]), offset));
    offsets.set(frame, found);
    return found;
  };
  return replaceValues(surface, selection.map((index) => {
    const { frame, point } = net.handles[index];
    const old = valueAt(begin, point);
    const moved = index === last
      ? place.slice(0, old.length)
      : old.map((/** @type {number} */ value, /** @type {number} */ axis) => addRounded(value, offsetIn(frame)[axis]));
    return [point, moved];
  }));
}

/**
 * The document with one weight for several points; nets without weights get weights, all others 1.
 * @param {Surface} surface @param {Net} net @param {number[]} selection @param {number} weight
 * @returns {Surface}
 */
export function weighTogether(surface, net, selection, weight) {
  const handles = selection.map((index) => net.handles[index]);
  /** @type {Map<string, [Path, unknown]>} */
  const added = new Map();
  handles.forEach((handle) => {
    const key = handle.weights.join();
    if (added.has(key) || valueAt(surface, handle.weights) !== undefined) return;
    added.set(key, [handle.weights, buildWeights(netAt(surface, handle))]);
  });
  return replaceValues(surface, [
    ...added.values(),
    ...handles.map((handle) => /** @type {[Path, unknown]} */ ([[...handle.weights, ...handle.indices], weight])),
  ]);
}

/**
 * The document with several points mirrored at a plane across an axis, each in the coordinates of its
 * own surface.
 * @param {Surface} surface @param {Net} net @param {number[]} selection @param {number} axis @param {number} offset
 * @returns {Surface}
 */
export function mirrorPoints(surface, net, selection, axis, offset) {
  return replaceValues(surface, selection.map((index) => {
    const { point } = net.handles[index];
    const mirrored = pointAt(surface, net.handles[index]).map((value, i) => (i === axis ? addRounded(2 * offset, -value) : value));
    return [point, mirrored];
  }));
}

/** A sum without the last, rounded digit. @param {number} value @param {number} change */
export function addRounded(value, change) {
  return change === 0 ? value : Number((value + change).toPrecision(DIGITS)) + 0;
}

/** The first three rows and columns of a placement. @param {number[]} matrix */
function linearPart(matrix) {
  return [0, 1, 2].map((row) => matrix.slice(4 * row, 4 * row + 3));
}

/** @param {number[][]} matrix @param {number[]} vector */
function apply(matrix, vector) {
  return matrix.map((row) => row.reduce((sum, value, k) => sum + value * vector[k], 0));
}

/** The vector x with M x = b, by Cramer's rule. @param {number[][]} matrix @param {number[]} right */
function solve(matrix, right) {
  const determinant = (/** @type {number[][]} */ [a, b, c]) => (
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
  );
  const whole = determinant(matrix);
  return [0, 1, 2].map((column) => (
    determinant(matrix.map((row, i) => row.map((value, k) => (k === column ? right[i] : value)))) / whole
  ));
}
