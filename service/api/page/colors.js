// The colours of the scene, light and dark, and the colours of curvatures.

/**
 * @typedef {object} Palette
 * @property {string} name  name of the colour of control points, used in texts
 * @property {string} glaze  a surface that has no colour of its own
 * @property {string} net  lines of the control net
 * @property {string} wires  the wireframe of the mesh
 * @property {string} point
 * @property {string} chosen
 * @property {string} section  lines of a section
 * @property {string} alarm  the chosen point, if an error names it
 * @property {number} shadow  opacity of the shadow on the floor
 */

/** @type {{light: Palette, dark: Palette}} */
export const PALETTES = {
  light: { name: 'black', glaze: '#2f86a0', net: '#5b4a36', wires: '#0d2833', point: '#3b2f22', chosen: '#e2711d', section: '#f012a6', alarm: '#c8102e', shadow: 0.26 },
  dark: { name: 'white', glaze: '#3a93ae', net: '#d8cdb9', wires: '#04141b', point: '#efe6d6', chosen: '#ffa04d', section: '#ff6fd0', alarm: '#ff5c6c', shadow: 0.5 },
};

/** Blue, through a light grey, to orange: readers with any kind of colour vision can distinguish the
 *  two sides of zero, and on each side the colours grow darker. sRGB, for values from -1 to 1 in equal
 *  steps. */
const DIVERGING = [
  [0.02, 0.19, 0.38], [0.10, 0.40, 0.66], [0.36, 0.65, 0.83], [0.70, 0.85, 0.93],
  [0.95, 0.95, 0.93],
  [0.98, 0.80, 0.60], [0.93, 0.57, 0.25], [0.75, 0.35, 0.05], [0.45, 0.19, 0.02],
];

/** Share of the area whose curvature is inside the range of colours. */
const SHOWN_SHARE = 0.9;

/** The sRGB colour of a value from -1 to 1. @param {number} value @returns {number[]} */
export function diverging(value) {
  const position = (Math.min(1, Math.max(-1, value)) + 1) / 2 * (DIVERGING.length - 1);
  const index = Math.min(DIVERGING.length - 2, Math.floor(position));
  return DIVERGING[index].map((c, i) => c + (position - index) * (DIVERGING[index + 1][i] - c));
}

/** The linear value of an sRGB component, for the renderer (IEC 61966-2-1). @param {number} c */
export function linear(c) {
  return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
}

/**
 * The largest value of the range of colours, on both sides of zero: 9/10 of the area have smaller
 * values. Otherwise the large values at a sharp rim would make the rest of the surface grey.
 * @param {{values: ArrayLike<number>, areas: ArrayLike<number>}[]} meshes  values and areas of vertices
 */
export function findRange(meshes) {
  const sizes = meshes.flatMap(({ values, areas }) => (
    Array.from(values, (value, i) => ({ size: Math.abs(value), area: areas[i] }))
  )).filter(({ size }) => Number.isFinite(size));
  sizes.sort((a, b) => a.size - b.size);
  let remainingArea = SHOWN_SHARE * sizes.reduce((sum, { area }) => sum + area, 0);
  const limit = sizes.find(({ area }) => { remainingArea -= area; return remainingArea <= 0; })?.size ?? 0;
  // If 9/10 of the area are flat up to rounding, the range ends at the largest value.
  return limit > 1e-9 ? limit : sizes.at(-1)?.size || 1;
}

/**
 * One linear colour for each value, three numbers each.
 * @param {ArrayLike<number>} values @param {number} range
 */
export function curvatureColors(values, range) {
  const colors = new Float32Array(3 * values.length);
  for (let i = 0; i < values.length; i += 1) {
    const value = Number.isFinite(values[i]) ? values[i] / range : 0;
    diverging(value).forEach((c, k) => { colors[3 * i + k] = linear(c); });
  }
  return colors;
}
