// Shows the report of the mesh: its size, its distance from the surface, and the time it took.

import { announce, element } from './page.js';

/** @typedef {import('./report.js').Report} Report */

/** @param {Report} report @param {{bytes: number, serverTime: number | null, roundTrip: number}} response */
export function showReadouts(report, { bytes, serverTime, roundTrip }) {
  put('triangles', report.triangles, report.triangles.toLocaleString('en'));
  put('vertices', report.vertices, report.vertices.toLocaleString('en'));
  put('bytes', bytes, bytesText(bytes));
  const bound = report.deviation_bound;
  put('deviation', bound, bound === null || bound === undefined ? 'not known' : significant(bound));
  const size = report.bounds.max.map((high, axis) => high - report.bounds.min[axis]);
  put('size', size.join(','), size.map((length) => Number(length.toPrecision(3))).join(' × '));
  const openEdges = report.boundary_edges;
  put('open-edges', openEdges, report.watertight ? 'none' : openEdges.toLocaleString('en'));
  const isPart = report.gap_bound !== undefined;
  showPartRows(isPart);
  if (isPart) showPart(report);
  put('server-time', serverTime, serverTime === null ? '–' : milliseconds(serverTime));
  put('round-trip', roundTrip, milliseconds(roundTrip));
}

/** Shows or hides the rows that only parts have. @param {boolean} isPart */
function showPartRows(isPart) {
  ['gaps', 'left-out', 'shared-edges'].forEach((id) => { element(`${id}-row`, HTMLElement).hidden = !isPart; });
}

/** Fills the rows that only parts have. @param {Report} report */
function showPart({ gap_bound: gap, skipped_faces: skipped = [], non_manifold_edges: shared = 0 }) {
  put('gaps', gap, typeof gap === 'number' ? significant(gap) : 'not known');
  const [first] = skipped;
  const reason = first && `${skipped.length} (face ${first.face}: ${first.code.replaceAll('_', ' ')}${skipped.length > 1 ? ', …' : ''})`;
  put('left-out', skipped.length, reason ?? 'none');
  put('shared-edges', shared, shared === 0 ? 'none' : shared.toLocaleString('en'));
}

/** Shows that the surface has no mesh. */
export function clearReadouts() {
  showPartRows(false);
  ['triangles', 'vertices', 'bytes', 'size', 'deviation', 'open-edges', 'server-time', 'round-trip']
    .forEach((id) => put(id, null, '–'));
}

/** Announces the report to users of screen readers. @param {Report} report */
export function speakReadouts(report) {
  const bound = report.deviation_bound;
  const deviation = typeof bound === 'number' ? `, deviation at most ${significant(bound)}` : '';
  announce(`${report.triangles.toLocaleString('en')} triangles${deviation}`);
}

/** @param {string} id @param {number | string | null | undefined} value @param {string} text */
function put(id, value, text) {
  const readout = element(id, HTMLDataElement);
  readout.value = value === null || value === undefined ? '' : String(value);
  if (readout.textContent !== text) readout.textContent = text;
}

/** Three digits, rounded up, so that a bound stays a bound. @param {number} value */
export function significant(value) {
  if (value === 0) return '0';
  const unit = 10 ** (Math.floor(Math.log10(Math.abs(value))) - 2);
  // Without 1e-9, a rounding error of the quotient could raise a value that has only three digits.
  const rounded = Math.ceil(value / unit - 1e-9) * unit;
  return Number(rounded.toPrecision(3)).toString().replace('e-', ' × 10^−');
}

/** @param {number} value */
function milliseconds(value) {
  return value < 10 ? `${value.toFixed(1)} ms` : `${Math.round(value).toLocaleString('en')} ms`;
}

/** @param {number} bytes */
function bytesText(bytes) {
  const [unit, size] = bytes < 1e6 ? ['kB', 1e3] : ['MB', 1e6];
  return `${(bytes / size).toFixed(bytes < 10 * size ? 1 : 0)} ${unit}`;
}
