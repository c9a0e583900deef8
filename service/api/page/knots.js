// Knot vectors of B-splines as numbers: where rows of control points act, and where a knot gives a new row.

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./selection.js').Direction} Direction */

/**
 * The knot vector along a direction of a B-spline, with its first and last knot: one more than the
 * control points and the degree together. A periodic one has no ends, so its list is empty.
 * @param {Surface} surface  as the service answers @param {Direction} direction @returns {number[]}
 */
export function knotsAlong(surface, direction) {
  const [knots, degree, count] = [surface.knots[direction], surface.degree[direction], countLines(surface, direction)];
  if (knots === 'periodic') return [];
  if (knots === 'uniform') return Array.from({ length: count + degree + 1 }, (_, i) => i - degree);
  if (knots === 'clamped') return clampedKnots(count, degree);
  return knots.length === count + degree + 1 ? knots : [knots[0], ...knots, knots[knots.length - 1]];
}

/** Clamped knots with spans of length 1, as their name in a request means. @param {number} count @param {number} degree */
export function clampedKnots(count, degree) {
  const last = count - degree;
  return Array.from({ length: count + degree + 1 }, (_, i) => Math.min(last, Math.max(0, i - degree)));
}

/** The number of rows (along u) or columns (along v) of a net. @param {Surface} surface @param {Direction} direction @returns {number} */
export function countLines(surface, direction) {
  return direction === 0 ? surface.control_net.length : surface.control_net[0].length;
}

/**
 * The parameter at which a row of control points acts most: its Greville abscissa, the mean of p knots.
 * @param {number[]} knots @param {number} degree @param {number} line
 */
export function findAbscissa(knots, degree, line) {
  return knots.slice(line + 1, line + degree + 1).reduce((sum, knot) => sum + knot, 0) / degree;
}

/**
 * The row that belongs to an inner knot: removing the row removes the knot (`findInnerKnot`). Of several,
 * the one that acts nearest to the knot.
 * @param {number[]} knots @param {number} degree @param {number} knot
 */
export function findLine(knots, degree, knot) {
  const lines = Array.from({ length: knots.length - degree - 1 }, (_, i) => i);
  const own = lines.filter((line) => knots[findInnerKnot(knots, degree, line)] === knot);
  const distance = (/** @type {number} */ line) => Math.abs(findAbscissa(knots, degree, line) - knot);
  return (own.length ? own : lines).reduce((best, line) => (distance(line) < distance(best) ? line : best));
}

/**
 * Where a new knot gives a new row between a row and the next one (of the last row, the one before): the
 * middle of the span there.
 * @param {number[]} knots @param {number} degree @param {number} line
 */
export function findNewKnot(knots, degree, line) {
  const count = knots.length - degree - 1;
  const first = Math.min(line, count - 2);
  const [low, high] = [knots[degree], knots[count]];
  const between = (findAbscissa(knots, degree, first) + findAbscissa(knots, degree, first + 1)) / 2;
  const place = Math.min(high, Math.max(low, between));
  const spans = knots.slice(degree, count + 1).slice(0, -1).map((start, i) => [start, knots[degree + i + 1]]);
  // At a knot, two spans are equally near: the longer one.
  const near = spans.filter(([start, end]) => start < end && start <= place && place <= end);
  const [start, end] = near.reduce((best, span) => (span[1] - span[0] > best[1] - best[0] ? span : best));
  return (start + end) / 2;
}

/**
 * The inner knot that acts nearest to a row: its index, the last of equal knots; −1 if there is none.
 * @param {number[]} knots @param {number} degree @param {number} line
 */
export function findInnerKnot(knots, degree, line) {
  const place = findAbscissa(knots, degree, line);
  let best = -1;
  for (let i = degree + 1; i < knots.length - degree - 1; i += 1) {
    if (best < 0 || Math.abs(knots[i] - place) < Math.abs(knots[best] - place) || knots[i] === knots[best]) best = i;
  }
  return best;
}
