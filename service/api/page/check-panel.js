// The results of a check: a section at the top of the panel, and the scale of the colours in the view.

import { paintLegend } from './legend.js';
import { element, makeElement } from './page.js';
import { significant } from './readouts.js';

/** @typedef {import('./check-request.js').Report} Report */
/** @typedef {import('./check-request.js').Distance} Distance */

/** Why the intervals are wider than asked for, by the word of the service. */
const LIMITS = new Map([
  ['work', 'more work than this service does at once would narrow them'],
  ['rounding', 'rounding errors are as large'],
  ['thin', 'the faces of this part are too thin'],
]);

/** @typedef {{close: () => void, again: () => void, lookAt: ((index: number) => void) | null}} Actions  null: nothing is drawn */

export class CheckPanel {
  /** @param {Actions} actions */
  constructor(actions) {
    this.actions = actions;
    this.section = makeElement('section', '');
    this.section.id = 'check';
    this.section.setAttribute('aria-labelledby', 'h-check');
    this.legend = buildLegend();
  }

  /** @param {string} name  of the file @param {Report} report @param {number} range  the end of the scale of colours */
  show(name, report, range) {
    const { lookAt } = this.actions;
    const list = document.createElement('dl');
    list.append(
      this.buildDistance('1', 'Surface to mesh', report.surface_to_mesh, 'The largest distance of a point of the surface from the mesh: proved to be between these numbers'),
      this.buildDistance('2', 'Mesh to surface', report.mesh_to_surface, 'The largest distance of a point of the mesh from the surface: proved to be between these numbers'),
      ...countsOf(report).map(([label, about, text]) => buildRow(label, about, text)),
    );
    const notes = [
      `No point of the surface is further than ${significant(report.surface_to_mesh.high)} from the mesh, and no point of the mesh further than ${significant(report.mesh_to_surface.high)} from the surface.`,
      lookAt ? 'The colours are the distances of the vertices and of the middles of triangles.' : '',
      report.reached ? '' : `The intervals are wider than asked for: ${LIMITS.get(report.limit ?? '') ?? 'the service found no narrower ones'}.`,
    ].filter(Boolean);
    const note = makeElement('p', notes.join(' '));
    note.className = 'hint';
    this.fill(name, list, note);
    this.legend.querySelectorAll('span')[1].textContent = significant(range);
    if (lookAt) document.querySelector('.corner')?.append(this.legend);
  }

  /** The surface is another one than that of the check. @param {string} name */
  showOutdated(name) {
    this.legend.remove();
    const note = makeElement('p', 'The surface has changed since the mesh was checked.');
    note.className = 'hint';
    this.fill(name, note, buildButton('Check again', this.actions.again));
  }

  /** @param {string} name @param {...Node} content */
  fill(name, ...content) {
    const heading = makeElement('h2', `Check of ${name}`);
    heading.id = 'h-check';
    const close = buildButton('Close the check', this.actions.close);
    close.title = 'Shows the surface again (Escape)';
    this.section.replaceChildren(heading, ...content, close);
    if (!this.section.isConnected) document.querySelector('.settings')?.prepend(this.section);
  }

  hide() {
    const hadFocus = this.section.contains(document.activeElement);
    this.section.remove();
    this.legend.remove();
    if (hadFocus) element('view', HTMLElement).focus();
  }

  /**
   * @param {string} number  of the mark @param {string} label @param {Distance} distance
   * @param {string} about
   */
  buildDistance(number, label, { low, high }, about) {
    const row = buildRow(`${number}: ${label}`, about, describeInterval(low, high));
    const { lookAt } = this.actions;
    if (!lookAt) return row;
    const show = buildButton('Look', () => lookAt(Number(number) - 1));
    show.setAttribute('aria-label', `Look at mark ${number}`);
    row.lastElementChild?.append(show);
    return row;
  }
}

/** The interval in words, its ends rounded outwards. @param {number} low @param {number} high */
export function describeInterval(low, high) {
  // `significant` rounds up, and a negative number upwards is its opposite downwards.
  const [from, to] = [significant(-low).replace(/^-/, ''), significant(high)];
  return from === to ? to : `${from} to ${to}`;
}

/** The rows of counts and of the normals: label, explanation, value. @param {Report} report @returns {string[][]} */
function countsOf(report) {
  const count = (/** @type {number} */ value) => (value === 0 ? 'none' : value.toLocaleString('en'));
  const { max_normal_angle: angle, skipped_faces: skipped = [] } = report;
  const rows = [
    ['Open edges', 'Edges of one triangle only, as at a rim', count(report.open_edges)],
    ['Edges of more than two triangles', 'A mesh with such edges is not manifold', count(report.non_manifold_edges)],
    ['Flipped edges', 'Edges of two triangles of which one is turned over', count(report.flipped_edges)],
    ['Degenerate triangles', 'Triangles without an area', count(report.degenerate_faces)],
    ['Triangles', 'A face of four corners is two of them', report.triangles.toLocaleString('en')],
  ];
  if (typeof angle === 'number') {
    rows.unshift(['Largest angle of normals', 'Between the normals of the mesh and of the surface: measured, not proved', `${significant(angle * 180 / Math.PI)}°`]);
  }
  if (skipped.length > 0) rows.push(['Faces left out', 'Invalid faces of the surface, which took no part', count(skipped.length)]);
  return rows;
}

/** @param {string} label @param {string} about @param {string} text */
function buildRow(label, about, text) {
  const row = document.createElement('div');
  const term = document.createElement('dt');
  const explained = makeElement('abbr', label);
  explained.title = about;
  term.append(explained);
  row.append(term, makeElement('dd', text));
  return row;
}

/** @param {string} label @param {() => void} act */
function buildButton(label, act) {
  const made = /** @type {HTMLButtonElement} */ (makeElement('button', label));
  made.type = 'button';
  made.addEventListener('click', act);
  return made;
}

function buildLegend() {
  const legend = document.createElement('figure');
  legend.id = 'check-legend';
  legend.className = 'legend';
  const bar = Object.assign(document.createElement('canvas'), { width: 192, height: 8 });
  bar.setAttribute('aria-hidden', 'true');
  paintLegend(bar, 0);
  const ends = document.createElement('p');
  ends.append(makeElement('span', '0'), makeElement('span', ''));
  legend.append(makeElement('figcaption', 'Distance from the surface'), bar, ends);
  return legend;
}
