// Shows where a plane across an axis cuts the surface, while its switch is on: the lines, how many of them
// are closed, and their length.

import { MeshRequests } from './mesh-requests.js';
import { announce, element, getChecked, input, radios, write } from './page.js';
import { section } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./report.js').Report} Report */
/** @typedef {import('./service.js').Polyline} Polyline */
/** @typedef {import('./state.js').State} State */

/**
 * @typedef {object} Callbacks
 * @property {(polylines: Polyline[]) => void} show  draws these lines, and no others
 * @property {(error: Error) => void} failed
 * @property {() => void} mended  called when an error of the section no longer applies
 */

const AXES = ['x', 'y', 'z'];
/** Milliseconds without a further change after which a request is sent. */
const PAUSE = 60;

export class Section {
  /** @param {State} state @param {Callbacks} callbacks */
  constructor(state, callbacks) {
    this.callbacks = callbacks;
    /** The box of the mesh that is shown. @type {Report['bounds'] | null} */
    this.bounds = null;
    /** Axis and offset of the last request; empty if the section must be requested again. */
    this.asked = '';
    this.hasFailed = false;
    this.timer = 0;
    /** @type {MeshRequests<{axis: number, offset: number}, Polyline[]>} */
    this.requests = new MeshRequests({
      send: ({ axis, offset }, outdated) => {
        const { surface } = state;
        return perform('Computing the section', (signal) => section(surface, axis, offset, signal), outdated);
      },
      answered: (polylines) => this.show(polylines),
      failed: (error) => this.fail(error),
      idle: () => {},
    });
    state.listen((change) => {
      if (change === 'opened') this.bounds = null;
      if (change !== 'settings' && change !== 'chosen') this.forget();
    });
    radios('section').forEach((radio) => radio.addEventListener('change', () => {
      this.update();
      element('section-slider', HTMLElement).scrollIntoView({ block: 'nearest' });
    }));
    input('section-offset').addEventListener('input', () => this.update());
  }

  /** Cuts the surface whose mesh is now shown. @param {Report['bounds']} bounds */
  showMesh(bounds) {
    this.bounds = bounds;
    this.update();
  }

  /** Requests the section that the switch and the slider describe, unless it was requested. */
  update() {
    const axis = AXES.indexOf(getChecked('section'));
    element('section-slider', HTMLElement).hidden = axis < 0;
    if (axis < 0) this.forget();
    if (axis < 0 || this.bounds === null) return;
    const slider = input('section-offset');
    const offset = offsetAt(this.bounds.min[axis], this.bounds.max[axis], Number(slider.value));
    const text = `${AXES[axis]} = ${String(offset).replace('-', '−')}`;
    write('section-offset-value', text);
    slider.setAttribute('aria-valuetext', text);
    if (text === this.asked) return;
    this.asked = text;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.requests.ask({ axis, offset }), PAUSE);
  }

  /** Removes the section, and drops its requests. */
  forget() {
    clearTimeout(this.timer);
    this.requests.forget();
    this.asked = '';
    this.clear();
  }

  /** @param {Polyline[]} polylines */
  show(polylines) {
    this.clear();
    const loopCount = polylines.filter(({ closed }) => closed).length;
    const length = polylines.reduce((sum, { points }) => sum + lengthOf(points), 0);
    const lineText = count(polylines.length - loopCount, 'open line');
    const text = `${count(loopCount, 'loop')}, ${lineText}, length ${Number(length.toPrecision(4))}`;
    put(String(length), text);
    this.callbacks.show(polylines);
    announce(`Section: ${text}`);
  }

  /** @param {Error} error */
  fail(error) {
    this.forget();
    this.hasFailed = true;
    this.callbacks.failed(error);
  }

  clear() {
    put('', '');
    this.callbacks.show([]);
    if (this.hasFailed) this.callbacks.mended();
    this.hasFailed = false;
  }
}

/** The offset at a share of the way between two bounds, with four digits of their distance. @param {number} low @param {number} high @param {number} share */
function offsetAt(low, high, share) {
  if (high <= low) return low;
  const unit = 10 ** (Math.floor(Math.log10(high - low)) - 3);
  return Number((Math.round((low + share * (high - low)) / unit) * unit).toPrecision(12));
}

/** @param {number[][]} points */
function lengthOf(points) {
  return points.slice(1).reduce((sum, end, i) => sum + Math.hypot(...end.map((value, k) => value - points[i][k])), 0);
}

/** @param {number} number @param {string} noun */
const count = (number, noun) => `${number} ${noun}${number === 1 ? '' : 's'}`;

/** Shows a text in the row of the section; hides the row if the text is empty. @param {string} value @param {string} text */
function put(value, text) {
  const readout = element('section', HTMLDataElement);
  readout.value = value;
  readout.textContent = text;
  element('section-row', HTMLElement).hidden = text === '';
}
