// The dialog "New surface": a patch or a B-spline of a chosen size.

import { makeSurface } from './new-surface.js';
import { button, element, getChecked, input, write } from './page.js';

/** @typedef {import('./documents.js').Surface} Surface */
/** @typedef {import('./new-surface.js').Extent} Extent */
/** @typedef {import('./state.js').About} About */

const DIRECTIONS = /** @type {const} */ (['u', 'v']);
/** The fewest control points of a periodic direction. */
const MIN_PERIODIC = 3;

/** @param {(surface: Surface, about: About) => void} open */
export function watchNewPanel(open) {
  const dialog = element('new-dialog', HTMLDialogElement);
  const form = element('new-form', HTMLFormElement);
  button('new').addEventListener('click', () => {
    element('library', HTMLDialogElement).close();
    dialog.showModal();
  });
  form.addEventListener('input', show);
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const isSpline = getChecked('new-kind') === 'bspline';
    const [u, v] = DIRECTIONS.map((name) => readExtent(name, isSpline));
    const isCurved = getChecked('new-shape') === 'curved';
    dialog.close();
    open(makeSurface(isSpline, u, v, isCurved), {
      title: isSpline ? 'New B-spline' : 'New patch',
      description: `A new surface of degree ${u.degree} × ${v.degree} with ${u.count} × ${v.count} control points.`,
      origin: '',
    });
  });
  show();
}

/** @param {'u' | 'v'} name @param {boolean} isSpline @returns {Extent} */
function readExtent(name, isSpline) {
  const degree = input(`new-degree-${name}`).valueAsNumber;
  const isPeriodic = isSpline && input(`new-periodic-${name}`).checked;
  return { degree, count: isSpline ? input(`new-count-${name}`).valueAsNumber : degree + 1, isPeriodic };
}

/** A patch has no number of points to choose; a B-spline has at least one point more than its degree. */
function show() {
  const isSpline = getChecked('new-kind') === 'bspline';
  element('new-spline', HTMLElement).hidden = !isSpline;
  DIRECTIONS.forEach((name) => {
    const count = input(`new-count-${name}`);
    const { degree, isPeriodic } = readExtent(name, isSpline);
    const least = isPeriodic ? MIN_PERIODIC : degree + 1;
    count.disabled = !isSpline;
    if (Number.isFinite(least)) count.min = String(least);
  });
  const isRound = DIRECTIONS.some((name) => readExtent(name, isSpline).isPeriodic);
  write('new-hint', isRound
    ? 'A periodic direction runs around: one makes a ring, two make a torus.'
    : 'Control points are one unit apart, z points up.');
}
