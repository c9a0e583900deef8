// Shows area and volume of the surface on request, and hides them when the surface changes.

import { announce, element } from './page.js';
import { hasSweep } from './settings.js';
import { measure } from './service.js';

/** @typedef {import('./state.js').State} State */

export class Measure {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** Number of changes of the surface: a response about an older surface is not shown. */
    this.changes = 0;
    state.listen((change) => {
      // The measures do not depend on the settings, nor on which control point is chosen.
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
    this.forget();
  }

  forget() {
    this.changes += 1;
    const { surface } = this.state;
    const hasNone = hasSweep(surface);
    element('measure', HTMLButtonElement).hidden = hasNone;
    // The button, if it is shown, is in the place of the area.
    put('area', '', hasNone ? '–' : '');
    put('volume', '', '–');
  }

  /** Requests the measures of the present surface. */
  async ask() {
    const { changes } = this;
    const measures = await measure(this.state.surface);
    if (changes !== this.changes) return;
    element('measure', HTMLButtonElement).hidden = true;
    put('area', String(measures.area.value), short(measures.area.value));
    const edges = measures.open_edges + measures.inconsistent_edges;
    const reason = `none: ${edges} open or inconsistent ${edges === 1 ? 'edge' : 'edges'}`;
    const volume = measures.volume ? short(measures.volume.value) : reason;
    put('volume', String(measures.volume?.value ?? ''), volume);
    announce(`Area ${short(measures.area.value)}; volume ${volume}`);
  }
}

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(6))).replace('-', '−');

/** @param {string} id @param {string} value @param {string} text */
function put(id, value, text) {
  const readout = element(id, HTMLDataElement);
  readout.value = value;
  readout.textContent = text;
}
