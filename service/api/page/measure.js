// Shows area and volume of the surface on request, and hides them when the surface changes.

import { announce, element } from './page.js';
import { reasonOf } from './probe.js';
import { client, define } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./state.js').State} State */

export class Measure {
  /** @param {State} state */
  constructor(state) {
    this.state = state;
    /** Aborts the request about an older surface. */
    this.outdated = new AbortController();
    state.listen((change) => {
      // The measures do not depend on the settings, nor on which control point is chosen.
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
    this.forget();
  }

  forget() {
    this.outdated.abort();
    this.outdated = new AbortController();
    // The button is in the place of the area.
    element('measure', HTMLButtonElement).hidden = false;
    put('area', '', '');
    put('volume', '', '–');
  }

  /** Requests the measures of the present surface; a refusal stands in place of them, with its reason. */
  async ask() {
    const { surface } = this.state;
    let measures;
    try {
      measures = await perform(
        'Measuring the area and the volume', (signal) => client.measure(define(surface), { tolerance: 1e-6 }, { signal }), this.outdated.signal,
      );
    } catch (error) {
      const reason = `none: ${reasonOf(error)}`;
      element('measure', HTMLButtonElement).hidden = true;
      put('area', '', reason);
      announce(`Area ${reason}`);
      return;
    }
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
