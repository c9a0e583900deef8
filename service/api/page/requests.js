// Reads JSON that a person opens: a surface, a request with one, or bare arrays of control points.

import { joinSurfaces } from './join.js';
import { Unreadable } from './unreadable.js';

/** @typedef {import('./documents.js').Surface} Surface */

/**
 * A surface that was read.
 * @typedef {object} Opened
 * @property {Surface} surface
 * @property {{[name: string]: unknown}} options  the other fields of a request
 * @property {string} note  what the page decided, in a sentence; may be empty
 */

/** The highest degree of a Bézier patch that is made of a bare array; larger nets are B-splines. */
export const MAX_PATCH_DEGREE = 9;
const SPLINE_DEGREE = 3;

/** The surface in a text. @param {string} text @returns {Opened} */
export function parseRequest(text) {
  let value;
  try {
    value = JSON.parse(text.replace(/^\uFEFF/, ''));
  } catch (error) {
    const detail = `The text is not the JSON of a surface. ${/** @type {Error} */ (error).message}`;
    const needed = /\b(?:NaN|Infinity)\b/.test(text) ? 'finite numbers: JSON has neither NaN nor Infinity' : undefined;
    throw new Unreadable({ code: 'malformed_body', detail, needed });
  }
  return readValue(value);
}

/** @param {any} value @returns {Opened} */
function readValue(value) {
  if (Array.isArray(value)) return readArray(value);
  if (!isObject(value)) throw wrongShape('one value');
  if (!('surface' in value)) return { surface: value, options: {}, note: '' };
  const { surface, ...options } = value;
  if (Array.isArray(surface)) return { ...readArray(surface), options };
  if (!isObject(surface)) throw wrongShape('a field `surface` that is no object');
  return { surface, options, note: '' };
}

/** A bare array: a control net, several nets, or several surfaces. @param {any[]} value @returns {Opened} */
function readArray(value) {
  if (value.length > 0 && value.every(isObject)) {
    const list = value.map(readValue);
    if (list.length === 1) return list[0];
    const named = list.map(({ surface }, i) => ({ name: surface.name ?? `surface ${i + 1}`, surface }));
    const note = `${list.length} surfaces, opened as a group.`;
    return { surface: joinSurfaces(named), options: list[0].options, note };
  }
  const depth = depthOf(value);
  if (depth === 3) return readNet(value);
  if (depth === 4) return readNets(value);
  throw wrongShape(depth === 2 ? 'one row of points' : `numbers in ${depth} levels of arrays`);
}

/** A net is a Bézier patch if its degrees are low, else a B-spline. @param {any[][][]} net @returns {Opened} */
function readNet(net) {
  /** @type {[number, number]} */
  const counts = [net.length, Math.max(...net.map((row) => row.length))];
  const { points, weights } = splitWeights(net);
  const fields = { control_net: points, ...(weights && { weights }) };
  const size = `An array of ${counts.join(' × ')} points`;
  const kind = chooseKind(counts);
  if (kind === null) {
    const degrees = counts.map((count) => count - 1).join(', ');
    return { surface: { type: 'bezier', ...fields }, options: {}, note: `${size}: a Bézier patch of degree (${degrees}).` };
  }
  const note = `${size}: a B-spline of degree (${kind.degree.join(', ')}); with "type": "bezier" it is one patch.`;
  return { surface: { ...kind, ...fields }, options: {}, note };
}

/**
 * The fields of the B-spline that a bare net of these counts of points is, or null for a Bézier patch.
 * @param {[number, number]} counts @returns {{type: 'bspline', degree: [number, number]} | null}
 */
export function chooseKind(counts) {
  if (counts.every((count) => count - 1 <= MAX_PATCH_DEGREE)) return null;
  const degreeOf = (/** @type {number} */ count) => Math.max(1, Math.min(SPLINE_DEGREE, count - 1));
  return { type: 'bspline', degree: [degreeOf(counts[0]), degreeOf(counts[1])] };
}

/** Nets of one size are Bézier patches with common vertices; others are a group. @param {any[]} nets @returns {Opened} */
function readNets(nets) {
  const opened = nets.map(readNet);
  const sizes = new Set(nets.map((net) => `${net.length} ${net.map((/** @type {any[]} */ row) => row.length)}`));
  if (sizes.size > 1 || opened.some(({ surface }) => surface.type !== 'bezier')) {
    const named = opened.map(({ surface }, i) => ({ name: `patch ${i + 1}`, surface }));
    return { surface: joinSurfaces(named), options: {}, note: `${nets.length} control nets, opened as a group.` };
  }
  /** @type {Map<string, number>} */
  const numbers = new Map();
  /** @type {number[][]} */
  const points = [];
  const patches = nets.map((net) => net.map((/** @type {number[][]} */ row) => row.map((point) => {
    const key = JSON.stringify(point);
    const number = numbers.get(key) ?? points.push(point) - 1;
    numbers.set(key, number);
    return number;
  })));
  const { points: [vertices], weights } = splitWeights([points]);
  const surface = { type: 'patches', vertices, patches, ...(weights && { weights: weights[0] }) };
  return { surface, options: {}, note: `${nets.length} Bézier patches, joined where their points are equal.` };
}

/** If points have four numbers, the last is the weight. @param {any[][][]} net */
function splitWeights(net) {
  const isWeighted = net.every((row) => row.every((point) => Array.isArray(point) && point.length === 4));
  return isWeighted
    ? { points: net.map((row) => row.map((point) => point.slice(0, 3))), weights: net.map((row) => row.map((point) => point[3])) }
    : { points: net };
}

/** The levels of arrays about the first number. @param {any} value @returns {number} */
function depthOf(value) {
  return Array.isArray(value) ? 1 + depthOf(value[0]) : 0;
}

/** @param {unknown} value */
function isObject(value) {
  return value !== null && typeof value === 'object' && !Array.isArray(value);
}

/** @param {string} got */
function wrongShape(got) {
  return new Unreadable({
    code: 'wrong_type',
    detail: 'The text is not the JSON of a surface.',
    got,
    needed: 'an object with a control net, a request with a `surface`, or an array of rows of points: [[[x, y, z], …], …]',
  });
}
