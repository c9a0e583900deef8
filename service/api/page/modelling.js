// Changes of whole nets, each one step of the history: rows and columns, degrees, knots, mirrored surfaces.
// The service computes those that keep the surface (`/v1/convert`), the page the others (`rows.js`).

import { countLines, findLine, findNewKnot, knotsAlong } from './knots.js';
import { joinHalves, reflect, reverse } from './mirror.js';
import { addMeanLine, lowerDegree, removeKnot, removeLine } from './rows.js';
import { LINES, mirrorPoints } from './selection.js';
import { convert } from './service.js';
import { change, replace } from './targets.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./mirror.js').Plane} Plane */
/** @typedef {import('./selection.js').Direction} Direction */
/** @typedef {import('./state.js').State} State */
/** @typedef {import('./targets.js').Outcome} Outcome */

const PARAMETERS = /** @type {const} */ (['u', 'v']);

/**
 * Adds a row of control points after that of the chosen point (at the last row, before it).
 * @param {State} state @param {Direction} direction @returns {Promise<string>}
 */
export function addLine(state, direction) {
  return change(state, direction, `Adding a ${LINES[direction]}`, async (surface, line, signal) => {
    if (surface.type !== 'bspline') return raise(surface, direction, signal);
    const plain = await convert(surface, undefined, signal);
    if (plain.knots[direction] === 'periodic') {
      const next = (line + 1) % countLines(plain, direction);
      const message = `A ${LINES[direction]} of mean points is between ${LINES[direction]}s ${line + 1} and ${next + 1}. `
        + 'The surface has changed: the spans of a periodic direction are equal.';
      return { surface: addMeanLine(plain, direction, line), message, line: line + 1 };
    }
    const knot = findNewKnot(knotsAlong(plain, direction), plain.degree[direction], line);
    return insert(plain, direction, knot, signal);
  });
}

/** Removes the row of the chosen point. @param {State} state @param {Direction} direction @returns {Promise<string>} */
export function deleteLine(state, direction) {
  return change(state, direction, `Removing a ${LINES[direction]}`, async (surface, line, signal) => {
    const plain = await convert(surface, undefined, signal);
    const last = countLines(plain, direction) - 2;
    if (plain.type !== 'bspline') {
      const { surface: lower, change: most } = lowerDegree(plain, direction);
      const message = `The degree along ${PARAMETERS[direction]} is ${last}. ${describeMove(most)}`;
      return { surface: lower, message, line: Math.min(line, last) };
    }
    if (plain.knots[direction] === 'periodic') {
      const message = `The ${LINES[direction]} ${line + 1} is removed, and the surface has changed: a periodic direction has equal spans.`;
      return { surface: removeLine(plain, direction, line), message, line: Math.min(line, last) };
    }
    const { surface: smaller, change: most, knot } = removeKnot(plain, direction, line);
    const message = `The knot ${PARAMETERS[direction]} = ${short(knot ?? 0)} is removed, and a ${LINES[direction]} with it. ${describeMove(most)}`;
    return { surface: smaller, message, line: Math.min(line, last) };
  });
}

/** Raises the degree along a direction by 1. @param {State} state @param {Direction} direction @returns {Promise<string>} */
export function raiseDegree(state, direction) {
  return change(state, direction, 'Raising the degree', (surface, _line, signal) => raise(surface, direction, signal));
}

/**
 * Inserts a knot; a Bézier patch becomes a B-spline.
 * @param {State} state @param {Direction} direction @param {number} knot @returns {Promise<string>}
 */
export function insertKnot(state, direction, knot) {
  return change(state, direction, 'Inserting a knot', (surface, _line, signal) => insert(surface, direction, knot, signal));
}

/**
 * Mirrors the whole document, or adds its mirrored copy.
 * @param {State} state @param {Plane} plane @param {boolean} keepsBoth @returns {Promise<string>}
 */
export async function mirror(state, plane, keepsBoth) {
  return replace(state, 'Mirroring the surface', async (signal) => {
    const copy = await reverse(reflect(state.surface, plane), signal);
    const where = `at ${'xyz'[plane.axis]} = ${short(plane.offset)}`;
    const message = keepsBoth ? `The surface has both halves, mirrored ${where}.` : `The surface is mirrored ${where}.`;
    return { surface: keepsBoth ? joinHalves(state.surface, copy) : copy, message: `${message} Normals stay on the same side.` };
  });
}

/** Mirrors the chosen points. @param {State} state @param {Plane} plane */
export function mirrorChosen(state, { axis, offset }) {
  state.commit();
  state.change(mirrorPoints(state.surface, state.net, state.selection, axis, offset), true);
  return `Mirrored ${state.selection.length === 1 ? 'the chosen point' : `${state.selection.length} points`}.`;
}

/** Writes homogeneous control points as places with weights. @param {State} state */
export function separateWeights(state) {
  return replace(state, 'Separating the weights', async (signal) => {
    const surface = await convert(state.surface, undefined, signal);
    return { surface, message: 'Control points are places now, with weights. The degree is higher where a weight was 0.' };
  });
}

/** @param {Surface} surface @param {Direction} direction @param {AbortSignal} signal @returns {Promise<Outcome>} */
async function raise(surface, direction, signal) {
  const degree = degreesOf(surface);
  const isTriangle = surface.type === 'triangle' || (surface.triangles?.length ?? 0) > 0;
  const raised = degree.map((value, i) => value + Number(isTriangle || i === direction));
  const result = await convert(surface, [{ op: 'elevate', degree: raised }], signal);
  const name = isTriangle ? `${raised[0]}` : raised.join(' × ');
  const message = `The degree is ${name}. The surface is the same, with more control points.`;
  return { surface: result, message: message + describeClamping(surface, direction) };
}

/** A sentence if an exact change clamps the direction, which was periodic or uniform. @param {Surface} surface @param {Direction} direction */
function describeClamping({ type, knots = 'clamped' }, direction) {
  const name = Array.isArray(knots) ? knots[direction] : knots;
  const isClamped = type !== 'bspline' || (name !== 'uniform' && name !== 'periodic');
  return isClamped ? '' : ` The direction ${PARAMETERS[direction]} is clamped now.`;
}

/** @param {Surface} surface @param {Direction} direction @param {number} knot @param {AbortSignal} signal @returns {Promise<Outcome>} */
async function insert(surface, direction, knot, signal) {
  const isPatch = surface.type !== 'bspline';
  const spline = isPatch
    ? { ...surface, type: 'bspline', degree: degreesOf(surface), knots: ['clamped', 'clamped'] } : surface;
  const result = await convert(spline, [{ op: 'insert', [PARAMETERS[direction]]: knot }], signal);
  const message = `A knot is at ${PARAMETERS[direction]} = ${short(knot)}. The surface is the same, with `
    + `${countLines(result, direction)} ${LINES[direction]}s.${isPatch ? ' The patch is a B-spline now.' : ''}`;
  const line = findLine(knotsAlong(result, direction), result.degree[direction], knot);
  return { surface: result, message: message + describeClamping(surface, direction), line };
}

/** The degrees along u and v; of patches the highest. @param {Surface} surface @returns {number[]} */
function degreesOf(surface) {
  if (surface.type === 'bspline') {
    const { degree = 3 } = surface;
    return Array.isArray(degree) ? degree : [degree, degree];
  }
  if (surface.type === 'triangle') return [surface.control_net.length - 1, surface.control_net.length - 1];
  if (surface.type !== 'patches') return [0, 1].map((direction) => countLines(surface, /** @type {Direction} */ (direction)) - 1);
  const grids = [...(surface.patches ?? []), ...(surface.triangles ?? [])];
  const degrees = [0, 1].map((direction) => grids.reduce((most, grid) => (
    Math.max(most, (direction === 0 ? grid.length : grid[0].length) - 1)
  ), 1));
  return surface.triangles?.length ? [Math.max(...degrees), Math.max(...degrees)] : degrees;
}

/** @param {number} most */
function describeMove(most) {
  if (most === Infinity) return 'The surface has changed.';
  return most < 1e-12 ? 'The surface is the same.' : `No point of the surface has moved by more than ${short(most)}.`;
}

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(3)));
