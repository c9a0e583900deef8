// Between the coordinates of a document and those of the scene. The scene is that of glTF: y points up,
// and the lengths of a document that gives its unit are in metres.

/** @typedef {import('./documents.js').Surface} Surface */

/** @param {Surface} surface @param {number[]} point @returns {number[]} */
export function toScene(surface, [x, y, z]) {
  const scale = findScale(surface);
  return (surface.up === 'z' ? [x, z, -y] : [x, y, z]).map((value) => scale * value);
}

/** @param {Surface} surface @param {number[]} point @returns {number[]} */
export function toDocument(surface, [x, y, z]) {
  const scale = findScale(surface);
  return (surface.up === 'z' ? [x, -z, y] : [x, y, z]).map((value) => value / scale);
}

/** @param {Surface} surface @returns {number} */
const findScale = ({ metres_per_unit: scale = 1 }) => scale;
