// A click on the surface marks the place and shows its coordinates, the parameters and curvatures there, and
// the distance from the previous click; on a part, also the face and the bound of its deviation. If the
// service has no answer, the reason stands in place of it.

import { ServiceError } from 'surface-service';
import { nameFace } from './faces.js';
import { announce, button, element } from './page.js';
import { significant } from './readouts.js';
import { client, curvatures, define } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./state.js').State} State */

/**
 * @typedef {object} Pin
 * @property {(point: number[], text: string) => void} show  marks a point of the document
 * @property {() => void} hide
 */

/**
 * What was clicked.
 * @typedef {object} Hit
 * @property {number[]} point  of the mesh, in the coordinates of the control points
 * @property {string} name  of the part of the mesh; empty without one
 * @property {number} face  its index in the list of faces, or -1
 */

const ROWS = ['place', 'probe', 'probe-deviation', 'probe-distance'];

export class Probe {
  /** @param {State} state @param {Pin} pin */
  constructor(state, pin) {
    this.state = state;
    this.pin = pin;
    /** The place of the last click. @type {number[] | null} */
    this.point = null;
    /** Whether a control point was chosen when the key was pressed. */
    this.hadPoint = false;
    /** Aborts the requests about an older click, or an older surface. */
    this.outdated = new AbortController();
    state.listen((change) => {
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
    const canvas = element('view', HTMLCanvasElement);
    button('place-clear').addEventListener('click', () => {
      this.forget();
      canvas.focus();
    });
    // The first Escape deselects a control point.
    canvas.addEventListener('keydown', ({ key }) => {
      if (key === 'Escape' && this.point !== null && !this.hadPoint) this.forget();
    });
    canvas.addEventListener('keydown', () => { this.hadPoint = state.chosen >= 0; }, { capture: true });
    button('place-copy').addEventListener('click', () => this.copy());
  }

  forget() {
    this.outdated.abort();
    this.point = null;
    this.pin.hide();
    ROWS.forEach((id) => show(id, '', ''));
  }

  /**
   * Shows what is known about the point of the surface that is closest to the point of its mesh.
   * @param {Pick<Hit, 'point' | 'name'>} hit @param {{name: string, deviation_bound?: number}[]} faces  the faces in the report of a brep; else none
   */
  async showPoint({ point, name }, faces = []) {
    const { surface } = this.state;
    const { point: previousPoint } = this;
    this.outdated.abort();
    this.outdated = new AbortController();
    this.showPlace(point);
    const found = await perform('Finding the point that was clicked', (signal) => (
      ask(surface, point, signal)
    ), this.outdated.signal);
    const { patch, position = point } = found;
    this.showPlace(position);
    const parts = [];
    if (surface.type === 'brep' && patch !== undefined) parts.push(nameFace(patch, faces));
    else {
      if (name) parts.push(name);
      if (patch !== undefined) parts.push(`patch ${patch}`);
    }
    parts.push(...found.facts);
    show('probe', found.uv?.join(',') ?? '', parts.join(', '));
    const bound = patch === undefined ? undefined : faces[patch]?.deviation_bound;
    const hasBound = typeof bound === 'number';
    show('probe-deviation', String(hasBound ? bound : ''), hasBound ? `at most ${significant(bound)}` : '');
    const distance = previousPoint
      && Math.hypot(...position.map((value, axis) => value - previousPoint[axis]));
    show('probe-distance', String(distance ?? ''), distance === null ? '' : short(distance));
    const place = element('place', HTMLDataElement).textContent;
    announce([place, ...parts].join(', ') + (distance === null ? '' : `; distance ${short(distance)}`));
  }

  /** Marks a place, and shows its coordinates. @param {number[]} point */
  showPlace(point) {
    this.point = point;
    const text = point.map((value, axis) => `${'xyz'[axis]} ${short(value)}`).join(', ');
    this.pin.show(point, text);
    show('place', point.join(','), text);
  }

  /** Copies the coordinates, with all of their digits. */
  async copy() {
    const text = this.point?.join(', ') ?? '';
    try {
      await navigator.clipboard.writeText(text);
      announce(`Copied: ${text}`);
    } catch {
      // Without permission for the clipboard, or without https, the user can copy what is selected.
      element('place', HTMLDataElement).textContent = text;
      getSelection()?.selectAllChildren(element('place', HTMLDataElement));
      announce('Selected, to be copied');
    }
  }
}

/**
 * @typedef {object} Found
 * @property {number[]} [position]  of the closest point of the surface
 * @property {number[]} [uv]
 * @property {number} [patch]
 * @property {string[]} facts  parameters and curvatures, or why there are none
 */

/** @param {import('./documents.js').Surface} surface @param {number[]} point @param {AbortSignal} signal @returns {Promise<Found>} */
async function ask(surface, point, signal) {
  let closest;
  try {
    closest = await client.project(define(surface), { points: [point] }, { signal });
  } catch (error) {
    return { facts: [`on the mesh; no parameters: ${reasonOf(error)}`] };
  }
  const { positions: [position], uv: [uv] = [[0, 0]], patch: [patch] = [], near_edge: [isNearEdge] = [] } = closest;
  const facts = [`u ${short(uv[0])}`, `v ${short(uv[1])}`];
  if (isNearEdge) facts.push('at an edge');
  try {
    const { gaussian, mean } = await curvatures(surface, uv, patch, signal);
    facts.push(`K ${shortOrNone(gaussian)}`, `H ${shortOrNone(mean)}`);
  } catch (error) {
    facts.push(`no curvatures: ${reasonOf(error)}`);
  }
  return { position, uv, patch, facts };
}

/** Why the service refuses something; throws other errors. @param {unknown} error */
export function reasonOf(error) {
  if (!(error instanceof ServiceError)) throw error;
  return error.errors[0]?.detail ?? error.message;
}

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(4))).replace('-', '−');

/** A curvature; where the surface has none, as at the tip of a cone, the service answers null. @param {number | null} value */
const shortOrNone = (value) => (value === null ? 'has no limit' : short(value));

/** Shows a text in a row of the readouts; hides the row if the text is empty. @param {string} id @param {string} value @param {string} text */
function show(id, value, text) {
  const readout = element(id, HTMLDataElement);
  readout.value = value;
  readout.textContent = text;
  element(`${id}-row`, HTMLElement).hidden = text === '';
}
