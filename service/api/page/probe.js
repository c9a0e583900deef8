// A click on the surface shows the parameters and curvatures there, and the distance from the point of
// the previous click.

import { announce, element } from './page.js';
import { isParametric } from './settings.js';
import { curvatures, project } from './service.js';

/** @typedef {import('./state.js').State} State */

export class Probe {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** @type {number[] | null} */
    this.before = null;
    /** Number of clicks: only the result of the last click is shown. */
    this.clicks = 0;
    state.listen((change) => {
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
  }

  forget() {
    this.clicks += 1;
    this.before = null;
    ['probe', 'probe-distance'].forEach((id) => show(id, '', ''));
  }

  /**
   * Shows the point of the surface that is closest to a point of its mesh.
   * @param {number[]} point  in the coordinates of the document
   */
  async at(point) {
    const { surface } = this.state;
    if (!isParametric(surface)) return;
    this.clicks += 1;
    const click = this.clicks;
    const { positions: [place], uv: [uv], patch } = await project(surface, point);
    const curvature = await curvatures(surface, uv, patch?.[0]);
    if (click !== this.clicks) return;
    const [u, v] = uv;
    const parts = [`u ${short(u)}`, `v ${short(v)}`];
    if (patch) parts.unshift(`patch ${patch[0]}`);
    if (curvature) parts.push(`K ${short(curvature.gaussian)}`, `H ${short(curvature.mean)}`);
    show('probe', `${u},${v}`, parts.join(', '));
    const { before } = this;
    const distance = before && Math.hypot(...place.map((value, axis) => value - before[axis]));
    show('probe-distance', String(distance ?? ''), distance === null ? '' : short(distance));
    this.before = place;
    announce(distance === null ? parts.join(', ') : `${parts.join(', ')}; distance ${short(distance)}`);
  }
}

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(4))).replace('-', '−');

/** Shows a text in a row of the readouts; hides the row if the text is empty. @param {string} id @param {string} value @param {string} text */
function show(id, value, text) {
  const place = element(id, HTMLDataElement);
  place.value = value;
  place.textContent = text;
  element(`${id}-row`, HTMLElement).hidden = text === '';
}
