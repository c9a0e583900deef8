// Rows and columns of control points that the page adds and removes itself, because the surface changes:
// conversions of the service keep every point. Each new row is a weighted sum of old rows. Where a row is
// removed from a patch or with a knot, the sums are those of least squares: adding the row again, exactly,
// would give a net as near to the old one as possible.

import { Unchangeable } from './documents.js';
import { clampedKnots, countLines, findInnerKnot, knotsAlong } from './knots.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./selection.js').Direction} Direction */

/** One new row: the numbers of old rows, and the share of each. @typedef {[number, number][]} Sum */

/**
 * A surface with other rows; `change`: no point of the surface has moved further, at equal parameters.
 * @typedef {{surface: Surface, change: number, knot?: number}} Reduced
 */

/**
 * A periodic B-spline with a row of mean points after a row.
 * @param {Surface} surface  as the service answers @param {Direction} direction @param {number} line
 */
export function addMeanLine(surface, direction, line) {
  const count = countLines(surface, direction);
  const sums = keepLines(count);
  sums.splice(line + 1, 0, [[line, 0.5], [(line + 1) % count, 0.5]]);
  return replaceLines(surface, direction, sums);
}

/** A periodic B-spline without a row. @param {Surface} surface @param {Direction} direction @param {number} line */
export function removeLine(surface, direction, line) {
  const count = countLines(surface, direction);
  if (count <= 3) throw new Unchangeable('A periodic direction needs at least 3 control points.');
  return replaceLines(surface, direction, keepLines(count).filter((_, i) => i !== line));
}

/**
 * A Bézier patch of a degree lower by 1, with the same corners.
 * @param {Surface} surface @param {Direction} direction @returns {Reduced}
 */
export function lowerDegree(surface, direction) {
  const degree = countLines(surface, direction) - 1;
  if (degree === 1) throw new Unchangeable('Degree 1 is the lowest: two rows of points.');
  // Elevation: old row i is α q_i + (1 − α) q_{i−1} with α = 1 − i / degree.
  const shares = Array.from({ length: degree - 1 }, (_, i) => 1 - (i + 1) / degree);
  return reduceLines(surface, direction, 0, shares, {});
}

/**
 * A B-spline without the inner knot that acts nearest to a row, and with one row less.
 * @param {Surface} surface  as the service answers @param {Direction} direction @param {number} line
 * @returns {Reduced}
 */
export function removeKnot(surface, direction, line) {
  const knots = knotsAlong(surface, direction);
  const degree = surface.degree[direction];
  const position = findInnerKnot(knots, degree, line);
  if (position < 0) {
    throw new Unchangeable(`A B-spline of degree ${degree} has at least ${degree + 1} rows of points in this direction.`);
  }
  const knot = knots[position];
  const left = knots.filter((_, i) => i !== position);
  const multiplicity = left.filter((other) => other === knot).length;
  // Boehm: with the knot, row i is α q_i + (1 − α) q_{i−1} for `first` < i ≤ span − multiplicity.
  const first = position - 1 - degree;
  const shares = Array.from({ length: Math.max(0, degree - multiplicity) }, (_, k) => {
    const i = first + 1 + k;
    return (knot - left[i]) / (left[i + degree] - left[i]);
  });
  const named = clampedKnots(countLines(surface, direction) - 1, degree);
  const isNamed = left.every((value, i) => value === named[i]);
  const all = [...surface.knots];
  all[direction] = isNamed ? 'clamped' : left;
  return { ...reduceLines(surface, direction, first, shares, { knots: all }), knot };
}

/**
 * The surface with one row less in a window of rows. With the row again, inner row i of the window would
 * be α_i q_i + (1 − α_i) q_{i−1}; the rows at both ends of the window stay.
 * @param {Surface} surface @param {Direction} direction @param {number} first  number of the window's first row
 * @param {number[]} shares  α of the inner rows @param {object} fields  fields that change too
 * @returns {Reduced}
 */
function reduceLines(surface, direction, first, shares, fields) {
  const count = countLines(surface, direction);
  const fitted = fitLines(shares).map((sum) => sum.map(([line, share]) => /** @type {[number, number]} */ ([first + line, share])));
  const old = keepLines(count);
  const sums = [...old.slice(0, first), ...fitted, ...old.slice(first + shares.length + 2)];
  const reduced = { ...replaceLines(surface, direction, sums), ...fields };
  const restored = [...keepLines(count - 1)];
  const inner = shares.map((share, k) => /** @type {Sum} */ ([[first + k, 1 - share], [first + k + 1, share]]));
  restored.splice(first + 1, Math.max(0, shares.length - 1), ...inner);
  return { surface: reduced, change: shares.length === 0 ? Infinity : boundChange(surface, reduced, direction, restored) };
}

/**
 * The rows q of least squares, as sums of the m + 1 rows of a window. q_0 and the last q are the ends of
 * the window; the normal equations of the others are tridiagonal.
 * @param {number[]} shares  α_1 … α_{m−1} @returns {Sum[]}
 */
function fitLines(shares) {
  const m = shares.length + 1;
  // A jump between two rows: their mean.
  if (m === 1) return [[[0, 0.5], [1, 0.5]]];
  const own = (/** @type {number} */ i) => shares[i - 1];
  const unknowns = Math.max(0, m - 2);
  const unit = (/** @type {number} */ line) => Array.from({ length: m + 1 }, (_, k) => Number(k === line));
  const rights = Array.from({ length: unknowns }, (_, k) => {
    const j = k + 1;
    const right = unit(j).map((value, line) => own(j) * value + (1 - own(j + 1)) * Number(line === j + 1));
    if (j === 1) right[0] -= own(1) * (1 - own(1));
    if (j === unknowns) right[m] -= own(m - 1) * (1 - own(m - 1));
    return right;
  });
  const diagonal = Array.from({ length: unknowns }, (_, k) => own(k + 1) ** 2 + (1 - own(k + 2)) ** 2);
  // Elimination without pivots: the matrix is positive definite.
  for (let k = 1; k < unknowns; k += 1) {
    const beside = own(k + 1) * (1 - own(k + 1));
    const factor = beside / diagonal[k - 1];
    diagonal[k] -= factor * beside;
    rights[k] = rights[k].map((value, line) => value - factor * rights[k - 1][line]);
  }
  for (let k = unknowns - 1; k >= 0; k -= 1) {
    const beside = k + 1 < unknowns ? own(k + 2) * (1 - own(k + 2)) : 0;
    rights[k] = rights[k].map((value, line) => (value - (beside ? beside * rights[k + 1][line] : 0)) / diagonal[k]);
  }
  const inner = rights.map((row) => row.map((share, line) => /** @type {[number, number]} */ ([line, share])));
  return [[[0, 1]], ...inner, [[m, 1]]];
}

/** Each row as it is. @param {number} count @returns {Sum[]} */
function keepLines(count) {
  return Array.from({ length: count }, (_, line) => [[line, 1]]);
}

/**
 * The surface with sums of its rows, in all nets that have a point for each control point.
 * @param {Surface} surface @param {Direction} direction @param {Sum[]} sums @returns {Surface}
 */
function replaceLines(surface, direction, sums) {
  const counts = [countLines(surface, 0), countLines(surface, 1)];
  const newCounts = counts.map((count, i) => (i === direction ? sums.length : count));
  /** @type {Surface} */
  const result = { ...surface };
  const net = mapLines(homogeneousNet(surface), direction, sums);
  result.control_net = net.map((row, i) => row.map((point, j) => {
    const sum = sums[direction === 0 ? i : j];
    const [k, l] = direction === 0 ? [sum[0][0], j] : [i, sum[0][0]];
    return sum.length === 1 ? surface.control_net[k][l] : findPlace(point);
  }));
  if (surface.weights) result.weights = net.map((row) => row.map((point) => point[3]));
  const changeChannel = (/** @type {number[][][]} */ channel, /** @type {boolean} */ isColor) => {
    const shape = [channel.length, channel[0].length];
    const isSpline = surface.type === 'bspline' && shape.join() === counts.join();
    if (!isSpline && surface.type === 'bspline' && shape.join() === newCounts.join()) {
      throw new Unchangeable('A net of colours or attributes would have as many rows and columns as the control net.');
    }
    if (!isSpline) return channel;
    const values = mapLines(channel, direction, sums);
    return isColor ? values.map((row) => row.map((color) => color.map((x) => Math.min(1, Math.max(0, x))))) : values;
  };
  if (surface.colors) result.colors = changeChannel(surface.colors, true);
  if (surface.uvs) result.uvs = changeChannel(surface.uvs, false);
  if (surface.attributes) {
    result.attributes = Object.fromEntries(Object.entries(surface.attributes).map(([name, channel]) => (
      [name, changeChannel(channel, false)]
    )));
  }
  return result;
}

/** The points (w x, w y, w z, w) of a net. @param {Surface} surface @returns {number[][][]} */
function homogeneousNet(surface) {
  return surface.control_net.map((/** @type {number[][]} */ row, /** @type {number} */ i) => row.map((point, j) => {
    const weight = surface.weights?.[i][j] ?? 1;
    return [0, 1, 2].map((axis) => weight * (point[axis] ?? 0)).concat(weight);
  }));
}

/** The place of a homogeneous point. @param {number[]} point */
function findPlace([x, y, z, w]) {
  if (!(w > 0)) throw new Unchangeable('The weights differ too strongly: without this row, one would not be positive.');
  return [x / w, y / w, z / w];
}

/** @param {number[][][]} net @param {Direction} direction @param {Sum[]} sums @returns {number[][][]} */
function mapLines(net, direction, sums) {
  if (direction === 1) return net.map((row) => sums.map((sum) => addShares(row, sum)));
  const columns = net[0].map((_, j) => net.map((row) => row[j]));
  return sums.map((sum) => columns.map((column) => addShares(column, sum)));
}

/** @param {number[][]} line @param {Sum} sum */
function addShares(line, sum) {
  if (sum.length === 1) return line[sum[0][0]];
  return line[0].map((_, k) => sum.reduce((total, [i, share]) => total + share * line[i][k], 0));
}

/**
 * A bound of the distance between two surfaces at equal parameters. Both have positive weights, and their
 * homogeneous nets A and B, with one number of points, differ by D. S_B − S_A is the mean of
 * D_xyz − S_A D_w, divided by the weight of B; relative to a middle, no point of A is further than ρ.
 * @param {Surface} old @param {Surface} reduced @param {Direction} direction
 * @param {Sum[]} restored  makes the number of rows of `reduced` that of `old`
 */
function boundChange(old, reduced, direction, restored) {
  const before = homogeneousNet(old).flat();
  const after = mapLines(homogeneousNet(reduced), direction, restored).flat();
  const middle = [0, 1, 2].map((axis) => {
    const values = before.map((point) => point[axis] / point[3]);
    return (values.reduce((low, value) => Math.min(low, value)) + values.reduce((high, value) => Math.max(high, value))) / 2;
  });
  const relative = (/** @type {number[]} */ point) => middle.map((value, axis) => point[axis] - value * point[3]);
  const radius = before.reduce((most, point) => Math.max(most, Math.hypot(...relative(point)) / point[3]), 0);
  let [difference, weightDifference, least] = [0, 0, Infinity];
  before.forEach((point, i) => {
    const [a, b] = [relative(point), relative(after[i])];
    difference = Math.max(difference, Math.hypot(...a.map((value, axis) => b[axis] - value)));
    weightDifference = Math.max(weightDifference, Math.abs(after[i][3] - point[3]));
    least = Math.min(least, after[i][3]);
  });
  return (difference + radius * weightDifference) / least;
}
