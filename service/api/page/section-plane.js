// The plane of a section in the coordinates of the document: all points p with normal · p = offset.

/** @typedef {{min: number[], max: number[]}} Bounds */

/**
 * @typedef {object} SectionPlane
 * @property {number[]} normal  a unit vector
 * @property {number} offset
 * @property {'both' | 'below' | 'above'} shown  the side that is shown: below is where the normal does not point
 */

/** The unit vector of a direction; null if it has none. @param {number[]} direction @returns {number[] | null} */
export function normalize(direction) {
  const length = Math.hypot(...direction);
  return length > 0 && Number.isFinite(length) ? direction.map((value) => value / length) : null;
}

/** @param {number[]} a @param {number[]} b */
export const dot = (a, b) => a.reduce((sum, value, axis) => sum + value * b[axis], 0);

/** The least and the largest offset of planes that meet a box. @param {number[]} normal @param {Bounds} bounds @returns {[number, number]} */
export function findRange(normal, { min, max }) {
  const ends = normal.map((value, axis) => [value * min[axis], value * max[axis]]);
  return [
    ends.reduce((sum, pair) => sum + Math.min(...pair), 0),
    ends.reduce((sum, pair) => sum + Math.max(...pair), 0),
  ];
}

/** The offset at a share of a range, with four digits of its width. @param {[number, number]} range @param {number} share */
export function offsetAt([low, high], share) {
  return roundIn([low, high], low + share * (high - low));
}

/** An offset with four digits of the width of a range. @param {[number, number]} range @param {number} offset */
export function roundIn([low, high], offset) {
  if (high <= low) return low;
  const unit = 10 ** (Math.floor(Math.log10(high - low)) - 3);
  return Number((Math.round(offset / unit) * unit).toPrecision(12));
}

/** @param {[number, number]} range @param {number} offset */
export function shareOf([low, high], offset) {
  return high <= low ? 0.5 : Math.min(1, Math.max(0, (offset - low) / (high - low)));
}

/** Such as "x = 0.5", or "0.6 x + 0.8 z = 0.5". @param {number[]} normal @param {number} offset */
export function describe(normal, offset) {
  const terms = normal.map((value, axis) => ({ value: Number(value.toFixed(3)), name: 'xyz'[axis] }))
    .filter(({ value }) => value !== 0);
  const text = terms.map(({ value, name }, i) => {
    const size = Math.abs(value) === 1 ? name : `${Math.abs(value)} ${name}`;
    if (i === 0) return value < 0 ? `−${size}` : size;
    return `${value < 0 ? '−' : '+'} ${size}`;
  }).join(' ');
  return `${text} = ${String(offset).replace('-', '−')}`;
}

const PLANE = /^(?:-?\d{1,20}(?:\.\d{1,20})?(?:e[+-]?\d{1,2})?(?:,|$)){4}$/;

/** The plane in four numbers with commas; null if they are none, or their normal has no direction. @param {string} text */
export function readPlane(text) {
  if (!PLANE.test(text)) return null;
  const [x, y, z, offset] = text.split(',').map(Number);
  return normalize([x, y, z]) === null ? null : { normal: [x, y, z], offset };
}
