// The lines of a section in words.

import { element } from './page.js';

/** @param {import('./service.js').Polyline[]} polylines @returns {{length: number, text: string}} */
export function describeLines(polylines) {
  const loopCount = polylines.filter(({ closed }) => closed).length;
  const length = polylines.reduce((sum, { points }) => sum + lengthOf(points), 0);
  const lines = [count(loopCount, 'loop'), count(polylines.length - loopCount, 'open line')];
  return { length, text: `${lines.join(', ')}, length ${Number(length.toPrecision(4))}` };
}

/** @param {number[][]} points */
function lengthOf(points) {
  return points.slice(1).reduce((sum, end, i) => sum + Math.hypot(...end.map((value, k) => value - points[i][k])), 0);
}

/** @param {number} number @param {string} noun */
const count = (number, noun) => `${number} ${noun}${number === 1 ? '' : 's'}`;

/** Shows a text in the row of the section; hides the row if the text is empty. @param {string} value @param {string} text */
export function put(value, text) {
  const readout = element('section', HTMLDataElement);
  readout.value = value;
  readout.textContent = text;
  element('section-row', HTMLElement).hidden = text === '';
}
