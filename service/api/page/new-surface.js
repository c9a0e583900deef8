// New surfaces to begin with: patches and B-splines of a chosen size, one unit between control points.

/** @typedef {import('./documents.js').Surface} Surface */

/**
 * What is chosen for a direction; a patch has one control point more than its degree.
 * @typedef {{degree: number, count: number, isPeriodic: boolean}} Extent
 */

/** The height of a curved surface, as a share of its smaller side; the widening of a ring, of its radius. */
const [RISE, BULGE] = [0.25, 0.2];
/** The fewest units of a radius. */
const MIN_RADIUS = 1;
const DIGITS = 4;

/**
 * A Bézier patch (`isSpline` false) or a B-spline, z upwards: flat, or slightly curved; a ring about z if
 * one direction is periodic; a torus if both are. Normals point upwards, or outwards.
 * @param {boolean} isSpline @param {Extent} u @param {Extent} v @param {boolean} isCurved @returns {Surface}
 */
export function makeSurface(isSpline, u, v, isCurved) {
  const place = choosePlacement(u, v, isCurved);
  const net = Array.from({ length: u.count }, (_, i) => (
    Array.from({ length: v.count }, (_unused, j) => place(i, j).map(round))
  ));
  const common = { up: 'z', name: isSpline ? 'B-spline' : 'patch', control_net: net };
  if (!isSpline) return { type: 'bezier', ...common };
  const knots = [u, v].map(({ isPeriodic }) => (isPeriodic ? 'periodic' : 'clamped'));
  return { type: 'bspline', degree: [u.degree, v.degree], knots, ...common };
}

/** @param {Extent} u @param {Extent} v @param {boolean} isCurved @returns {(i: number, j: number) => number[]} */
function choosePlacement(u, v, isCurved) {
  /** From −1 to 1. @param {number} i @param {number} count */
  const share = (i, count) => (2 * i) / (count - 1) - 1;
  const [width, depth] = [u.count - 1, v.count - 1];
  if (u.isPeriodic && v.isPeriodic) {
    const small = radiusOf(v.count);
    const large = Math.max(radiusOf(u.count), 2 * small);
    return (i, j) => {
      const [turn, tilt] = [angle(i, u.count), angle(j, v.count)];
      const distance = large + small * Math.cos(tilt);
      return [distance * Math.cos(turn), distance * Math.sin(turn), small * Math.sin(tilt)];
    };
  }
  if (u.isPeriodic || v.isPeriodic) {
    // Along u downwards if v runs around, so that normals point outwards.
    const [around, along] = u.isPeriodic ? [u.count, v.count] : [v.count, u.count];
    const radius = radiusOf(around);
    return (i, j) => {
      const turn = angle(u.isPeriodic ? i : j, around);
      const height = u.isPeriodic ? share(j, along) : -share(i, along);
      const distance = radius * (1 + (isCurved ? BULGE * (1 - height * height) : 0));
      return [distance * Math.cos(turn), distance * Math.sin(turn), (height * (along - 1)) / 2];
    };
  }
  const rise = isCurved ? RISE * Math.min(width, depth) : 0;
  return (i, j) => {
    const [s, t] = [share(i, u.count), share(j, v.count)];
    return [(s * width) / 2, (t * depth) / 2, rise * (1 - s * s) * (1 - t * t)];
  };
}

/** @param {number} i @param {number} count */
const angle = (i, count) => (2 * Math.PI * i) / count;

/** @param {number} count  of points around */
const radiusOf = (count) => Math.max(MIN_RADIUS, count / (2 * Math.PI));

/** @param {number} value */
const round = (value) => Number(value.toFixed(DIGITS)) + 0;
