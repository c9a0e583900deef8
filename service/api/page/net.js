// The control net of every kind of surface: its control points, the path of each in the document, the
// lines that join them, and the placement of their surface in the scene. net-view.js draws it.

import { valueAt } from './documents.js';

/** @typedef {import('./documents.js').Path} Path */
/** @typedef {import('./documents.js').Surface} Surface */

/**
 * One control point.
 * @typedef {object} Handle
 * @property {Path} point  path of its coordinates
 * @property {Path} weights  path of the weights of its net, if the net has any
 * @property {Path} indices  its indices in the net, and in the weights
 * @property {number} frame  index of the placement of its surface in `frames`
 */

/**
 * @typedef {object} Net
 * @property {Handle[]} handles
 * @property {[number, number][]} edges  pairs of handles that a line joins
 * @property {number[][]} frames  placements, 4 × 4 row by row, from the document to the scene
 */

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
// Quarter turns about x, because the y axis of glTF and of the scene points up.
const Z_TO_Y = [1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1];
const Y_TO_Z = [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1];

/**
 * The net of a surface. Invalid parts are left out: the error of the service describes them.
 * @param {Surface} surface
 * @returns {Net}
 */
export function netOf(surface) {
  /** @type {Net} */
  const net = { handles: [], edges: [], frames: [] };
  const upright = surface.up === 'z' ? Z_TO_Y : IDENTITY;
  if (surface.type !== 'group') {
    addSurface(net, surface, [], upright);
    return net;
  }
  list(surface.members).forEach((member, index) => {
    const memberSurface = member?.surface ?? {};
    // The matrix of a member applies in the coordinates of the group, so after this turn.
    const turn = findTurn(memberSurface.up ?? 'y', surface.up ?? 'y');
    const matrix = Array.isArray(member?.matrix) ? member.matrix.flat() : IDENTITY;
    if (matrix.length !== 16) return;
    addSurface(net, memberSurface, ['members', index, 'surface'], product(upright, product(matrix, turn)));
  });
  return net;
}

/**
 * The three coordinates of a control point; two in a plane curve.
 * @param {Surface} surface
 * @param {Handle} handle
 * @returns {number[]}
 */
export function pointAt(surface, handle) {
  return valueAt(surface, handle.point);
}

/**
 * @param {Surface} surface
 * @param {Handle} handle
 * @returns {number}
 */
export function weightAt(surface, handle) {
  return valueAt(surface, [...handle.weights, ...handle.indices]) ?? 1;
}

/** The path of the surface that has a control point. @param {Handle} handle @returns {Path} */
export function baseOf({ point, indices }) {
  const net = point.slice(0, point.length - indices.length);
  return net.slice(0, net.at(-1) === 'control_points' ? -2 : -1);
}

/** @param {Surface} surface @param {Handle} handle */
export function netAt(surface, handle) {
  return valueAt(surface, handle.point.slice(0, handle.point.length - handle.indices.length));
}

/** Weights of 1 for all points of a net. @param {any} net @returns {any} */
export function buildWeights(net) {
  return isPoint(net) ? 1 : net.map(buildWeights);
}

/** @param {Net} net @param {Surface} surface @param {Path} base  path of the surface @param {number[]} placement */
function addSurface(net, surface, base, placement) {
  const frame = net.frames.push(placement) - 1;
  const target = { net, base, frame };
  if (surface.type === 'multipatch') {
    list(surface.surfaces).forEach((inner, index) => (
      addSurface(net, inner, [...base, 'surfaces', index], placement)
    ));
  } else if (surface.type === 'patches') addPatches(target, surface);
  else if (surface.type === 'tube' || surface.type === 'ribbon') addCurve(target, surface.curve ?? {});
  else addRows(target, surface);
}

/**
 * The net that gets the control points of a surface, the path of the surface, and the index of its
 * placement in `net.frames`.
 * @typedef {{net: Net, base: Path, frame: number}} Target
 */

/**
 * Bézier, B-spline and triangular nets: rows of points.
 * @param {Target} target @param {Surface} surface
 */
function addRows({ net, base, frame }, surface) {
  const isTriangle = surface.type === 'triangle';
  const [closedU, closedV] = surface.type === 'bspline' ? arePeriodic(surface.knots) : [false, false];
  const rows = listPoints(surface, surface.control_net).map((row, i) => list(row).map((point, j) => (
    addHandle(net, point, {
      point: [...base, 'control_net', i, j], weights: [...base, 'weights'], indices: [i, j], frame,
    })
  )));
  const join = buildJoin(net);
  rows.forEach((row, i) => row.forEach((handle, j) => {
    join(handle, row[j + 1] ?? (closedV ? row[0] : -1));
    join(handle, (rows[i + 1] ?? (closedU ? rows[0] : []))[j]);
    if (isTriangle && j > 0) join(handle, rows[i + 1]?.[j - 1]);
  }));
}

/** @param {Target} target @param {Surface} surface */
function addPatches({ net, base, frame }, surface) {
  const vertices = listPoints(surface, surface.vertices).map((point, i) => (
    addHandle(net, point, {
      point: [...base, 'vertices', i], weights: [...base, 'weights'], indices: [i], frame,
    })
  ));
  const join = buildJoin(net);
  const joinGrids = (/** @type {any} */ patches, /** @type {boolean} */ areTriangles) => (
    list(patches).forEach((grid) => list(grid).forEach((row, i) => list(row).forEach((index, j) => {
      join(vertices[index], vertices[row[j + 1]]);
      join(vertices[index], vertices[grid[i + 1]?.[j]]);
      if (areTriangles && j > 0) join(vertices[index], vertices[grid[i + 1]?.[j - 1]]);
    })))
  );
  joinGrids(surface.patches, false);
  joinGrids(surface.triangles, true);
}

/** @param {Target} target @param {Surface} curve */
function addCurve({ net, base, frame }, curve) {
  const points = listPoints(curve, curve.control_points).map((point, i) => (
    addHandle(net, point, {
      point: [...base, 'curve', 'control_points', i],
      weights: [...base, 'curve', 'weights'],
      indices: [i],
      frame,
    })
  ));
  const join = buildJoin(net);
  points.forEach((handle, i) => join(handle, points[i + 1]));
  if (curve.type === 'bspline' && curve.knots === 'periodic') join(points.at(-1), points[0]);
}

/** Adds a handle and returns its number; -1 if the document has no point there. @param {Net} net @param {any} point @param {Handle} handle */
function addHandle(net, point, handle) {
  return isPoint(point) ? net.handles.push(handle) - 1 : -1;
}

/**
 * A function that joins two handles by a line, once for each pair; ignores values that are no handles.
 * @param {Net} net
 */
function buildJoin(net) {
  const seen = new Set();
  return (/** @type {number | undefined} */ a, /** @type {number | undefined} */ b) => {
    if (a === undefined || b === undefined || a < 0 || b < 0 || a === b) return;
    const key = Math.min(a, b) * net.handles.length + Math.max(a, b);
    if (seen.has(key)) return;
    seen.add(key);
    net.edges.push([a, b]);
  };
}

/** Whether the knots along u and v are periodic. @param {any} knots @returns {[boolean, boolean]} */
function arePeriodic(knots) {
  const [u, v] = Array.isArray(knots) ? knots : [knots, knots];
  return [u === 'periodic', v === 'periodic'];
}

/** The value, or an empty list if it is no list. @param {any} value @returns {any[]} */
function list(value) {
  return Array.isArray(value) ? value : [];
}

/**
 * The control points, or rows of them. Homogeneous ones are left out: (w x, w y, w z, w) is no place.
 * @param {Surface} owner  the surface or the curve that has the points @param {any} points
 */
function listPoints(owner, points) {
  return owner.homogeneous === true ? [] : list(points);
}

/** @param {any} value */
function isPoint(value) {
  return Array.isArray(value) && (value.length === 2 || value.length === 3)
    && value.every((number) => typeof number === 'number');
}

/** The rotation from one vertical axis to another. @param {string} up @param {string} target */
function findTurn(up, target) {
  if (up === target) return IDENTITY;
  return up === 'z' ? Z_TO_Y : Y_TO_Z;
}

/** The product of two matrices, row by row. @param {number[]} a @param {number[]} b */
function product(a, b) {
  return a.map((_, index) => {
    const [rowStart, column] = [4 * Math.floor(index / 4), index % 4];
    return [0, 1, 2, 3].reduce((sum, k) => sum + a[rowStart + k] * b[4 * k + column], 0);
  });
}
