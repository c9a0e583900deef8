// A click on the surface shows the parameters and curvatures there, and the distance from the point of
// the previous click; on a part, the face and the bound of its deviation.

import { announce, element } from './page.js';
import { hasPart, hasSweep } from './settings.js';
import { significant } from './readouts.js';
import { curvatures, project } from './service.js';

/** @typedef {import('./state.js').State} State */

export class Probe {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** @type {number[] | null} */
    this.previousPoint = null;
    /** Number of clicks and changes of the surface: a response to an older request is not shown. */
    this.requestNumber = 0;
    state.listen((change) => {
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
  }

  forget() {
    this.requestNumber += 1;
    this.previousPoint = null;
    ['probe', 'probe-distance'].forEach((id) => show(id, '', ''));
  }

  /**
   * Shows the parameters and curvatures at the point of the surface that is closest to a point of its mesh.
   * @param {number[]} point  in the coordinates of the control points
   */
  async showPoint(point) {
    const { surface } = this.state;
    if (hasSweep(surface) || hasPart(surface)) return; // the service finds no closest points of these
    this.requestNumber += 1;
    const { requestNumber } = this;
    const { positions: [position], uv: [uv], patch } = await project(surface, point);
    const curvature = await curvatures(surface, uv, patch?.[0]);
    if (requestNumber !== this.requestNumber) return;
    const [u, v] = uv;
    const parts = [`u ${short(u)}`, `v ${short(v)}`];
    if (patch) parts.unshift(`patch ${patch[0]}`);
    if (curvature) parts.push(`K ${short(curvature.gaussian)}`, `H ${short(curvature.mean)}`);
    show('probe', `${u},${v}`, parts.join(', '));
    const { previousPoint } = this;
    const distance = previousPoint
      && Math.hypot(...position.map((value, axis) => value - previousPoint[axis]));
    show('probe-distance', String(distance ?? ''), distance === null ? '' : short(distance));
    this.previousPoint = position;
    announce(distance === null ? parts.join(', ') : `${parts.join(', ')}; distance ${short(distance)}`);
  }
}

/** Shows a face of a part. @param {{name: string, deviation_bound?: number}} part */
export function showFace({ name, deviation_bound: bound }) {
  const text = bound === undefined ? name : `${name}, deviation at most ${significant(bound)}`;
  show('probe', name, text);
  announce(text);
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
