// A click on the surface shows the parameters and curvatures there, and the distance from the point of
// the previous click; on a part, also the face and the bound of its deviation.

import { announce, element } from './page.js';
import { hasSweep } from './settings.js';
import { significant } from './readouts.js';
import { curvatures, project } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./state.js').State} State */

export class Probe {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** @type {number[] | null} */
    this.previousPoint = null;
    /** Aborts the requests about an older click, or an older surface. */
    this.outdated = new AbortController();
    state.listen((change) => {
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
  }

  forget() {
    this.outdated.abort();
    this.previousPoint = null;
    ['probe', 'probe-deviation', 'probe-distance'].forEach((id) => show(id, '', ''));
  }

  /**
   * Shows the parameters and curvatures at the point of the surface that is closest to a point of its mesh.
   * @param {number[]} point  in the coordinates of the control points
   * @param {{name: string, deviation_bound?: number}[]} faces  the faces in the report of a brep; else none
   */
  async showPoint(point, faces = []) {
    const { surface } = this.state;
    if (hasSweep(surface)) return; // the service finds no closest points of these
    this.outdated.abort();
    this.outdated = new AbortController();
    const { closest, curvature } = await perform('Finding the point that was clicked', async (signal) => {
      const found = await project(surface, point, signal);
      return { closest: found, curvature: await curvatures(surface, found.uv[0], found.patch?.[0], signal) };
    }, this.outdated.signal);
    const { positions: [position], uv: [uv], patch, near_edge: nearEdge } = closest;
    const [u, v] = uv;
    const parts = [`u ${short(u)}`, `v ${short(v)}`];
    if (patch) parts.unshift(surface.type === 'brep' ? nameFace(patch[0], faces) : `patch ${patch[0]}`);
    if (nearEdge?.[0]) parts.push('at an edge');
    if (curvature) parts.push(`K ${short(curvature.gaussian)}`, `H ${short(curvature.mean)}`);
    show('probe', `${u},${v}`, parts.join(', '));
    const bound = patch && faces[patch[0]]?.deviation_bound;
    const hasBound = typeof bound === 'number';
    show('probe-deviation', String(hasBound ? bound : ''), hasBound ? `at most ${significant(bound)}` : '');
    const { previousPoint } = this;
    const distance = previousPoint
      && Math.hypot(...position.map((value, axis) => value - previousPoint[axis]));
    show('probe-distance', String(distance ?? ''), distance === null ? '' : short(distance));
    this.previousPoint = position;
    announce(distance === null ? parts.join(', ') : `${parts.join(', ')}; distance ${short(distance)}`);
  }
}

/** The number of a face, and its name if it has one. @param {number} number @param {{name: string}[]} faces */
function nameFace(number, faces) {
  const text = `face ${number}`;
  const name = faces[number]?.name;
  return name === undefined || name === text ? text : `${text} (${name})`;
}

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(4))).replace('-', '−');

/** Shows a text in a row of the readouts; hides the row if the text is empty. @param {string} id @param {string} value @param {string} text */
function show(id, value, text) {
  const readout = element(id, HTMLDataElement);
  readout.value = value;
  readout.textContent = text;
  element(`${id}-row`, HTMLElement).hidden = text === '';
}
