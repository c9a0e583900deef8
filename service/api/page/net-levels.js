// Which points and lines of a net are drawn: of a dense net every second, fourth, … row and column, so that
// the lines do not cover the surface.

/** @typedef {import('./net.js').Net} Net */

/** The least distance of points that are drawn, in CSS pixels. */
const MIN_SPACING = 16;
/** The level of the first and the last row, which are always drawn. */
export const MAX_LEVEL = 31;

/**
 * Points and lines, sorted by level, the highest first. A row, or column, of level k is drawn in every net that
 * draws each 2^k-th one.
 * @typedef {object} Levels
 * @property {Uint32Array} points  numbers of points
 * @property {Uint32Array} edges  two numbers of points for each line
 * @property {number[]} pointCounts  how many points have at least level k
 * @property {number[]} edgeCounts
 */

/**
 * The levels of a net. Points that are in no grid, such as those of `patches`, count as one row; their lines are
 * always drawn.
 * @param {Net} net @returns {Levels}
 */
export function findLevels({ handles, edges }) {
  const indices = handles.map((handle) => handle.indices.map(Number));
  const ends = findEnds(handles, indices);
  const levels = indices.map((each, i) => each.map((index, axis) => levelOf(index, ends[i][axis])));
  const pointLevels = levels.map((each) => Math.min(...each));
  const edgeLevels = edges.map(([a, b]) => edgeLevel(indices[a], indices[b], levels[a]));
  const pointOrder = sortByLevel(pointLevels);
  const edgeOrder = sortByLevel(edgeLevels);
  return {
    points: pointOrder,
    edges: Uint32Array.from(Array.from(edgeOrder, (i) => edges[i]).flat()),
    pointCounts: countLevels(pointLevels),
    edgeCounts: countLevels(edgeLevels),
  };
}

/**
 * The level from which rows are drawn, if neighbours are this far apart on the screen.
 * @param {number} spacing  in CSS pixels
 */
export function chooseLevel(spacing) {
  return Math.min(MAX_LEVEL, Math.max(0, Math.ceil(Math.log2(MIN_SPACING / Math.max(spacing, 1e-3)))));
}

/**
 * The largest index in each direction of the net to which each handle belongs.
 * @param {Net['handles']} handles @param {number[][]} indices @returns {number[][]}
 */
function findEnds(handles, indices) {
  /** @type {Map<string, number[]>} */
  const nets = new Map();
  return handles.map(({ point }, i) => {
    const key = point.slice(0, point.length - indices[i].length).join('/');
    const ends = nets.get(key) ?? indices[i].map(() => 0);
    nets.set(key, ends);
    indices[i].forEach((index, axis) => { ends[axis] = Math.max(ends[axis], index); });
    return ends;
  });
}

/** How often 2 divides the number of a row. @param {number} index @param {number} end  the number of the last row */
function levelOf(index, end) {
  return index === 0 || index === end ? MAX_LEVEL : Math.min(MAX_LEVEL, 31 - Math.clz32(index & -index));
}

/** The level of the row or column in which a line lies. @param {number[]} a @param {number[]} b @param {number[]} levels  of the rows of a */
function edgeLevel(a, b, levels) {
  if (a.length !== 2 || b.length !== 2) return MAX_LEVEL;
  const fixed = a.findIndex((index, axis) => index === b[axis]);
  return fixed < 0 ? Math.min(...levels) : levels[fixed]; // a diagonal of a triangular net is in no row
}

/** @param {number[]} levels */
function sortByLevel(levels) {
  return Uint32Array.from(levels.keys()).sort((a, b) => levels[b] - levels[a] || a - b);
}

/** How many have at least level 0, 1, … @param {number[]} levels */
function countLevels(levels) {
  const counts = Array.from({ length: MAX_LEVEL + 1 }, () => 0);
  levels.forEach((level) => { counts[level] += 1; });
  for (let k = MAX_LEVEL - 1; k >= 0; k -= 1) counts[k] += counts[k + 1];
  return counts;
}
