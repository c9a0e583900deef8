// Shows where a plane cuts the surface, while its switch is on: the lines, how many of them are closed, and
// their length. The plane is across an axis, or has any normal.

import { NewestOnly } from 'surface-service';
import { announce, button, checkRadio, element, getChecked, input, radios, write } from './page.js';
import { describe, dot, findRange, normalize, offsetAt, readPlane, roundIn, shareOf } from './section-plane.js';
import { describeLines, put } from './section-lines.js';
import { section } from './service.js';
import { perform } from './work.js';

/** @typedef {import('./report.js').Report} Report */
/** @typedef {import('./section-plane.js').SectionPlane} SectionPlane */
/** @typedef {import('./service.js').Polyline} Polyline */
/** @typedef {import('./state.js').State} State */

/**
 * @typedef {object} Callbacks
 * @property {(polylines: Polyline[]) => void} show  draws these lines, and no others
 * @property {(plane: SectionPlane | null) => void} showPlane  draws the plane; null draws none
 * @property {() => number[] | null} facing  the direction towards the viewer, in the document
 * @property {() => number[] | null} place  the point that was clicked last
 * @property {(error: Error) => void} failed
 * @property {() => void} mended  called when an error of the section no longer applies
 */

const AXES = ['x', 'y', 'z'];
const NORMAL_FIELDS = ['section-nx', 'section-ny', 'section-nz'];
/** Milliseconds after a change after which a request is sent, with all changes until then. */
const PAUSE = 30;
/** Milliseconds after the last change until the settings have the plane. */
const NOTE_PAUSE = 250;

export class Section {
  /** @param {State} state @param {Callbacks} callbacks */
  constructor(state, callbacks) {
    this.state = state;
    this.callbacks = callbacks;
    /** The box of the mesh that is shown. @type {Report['bounds'] | null} */
    this.bounds = null;
    /** An offset that was typed, or to which the plane was dragged; null: that of the slider. @type {number | null} */
    this.exactOffset = null;
    /** The plane of the last request as a text; empty if the section must be requested again. */
    this.asked = '';
    this.hasFailed = false;
    this.timer = 0;
    this.noteTimer = 0;
    /** The settings of the plane, as the controls show them. */
    this.noted = { section: '', sectionShown: 'both' };
    /** The plane of the next request. */
    this.wanted = { normal: [1, 0, 0], offset: 0 };
    /** The offset to which the plane was dragged, with all digits. @type {number | null} */
    this.dragged = null;
    /** @type {NewestOnly<{normal: number[], offset: number}, Polyline[]>} */
    this.requests = new NewestOnly(({ normal, offset }, outdated) => {
      const { surface } = state;
      return perform('Computing the section', (signal) => section(surface, normal, offset, signal), outdated);
    });
    state.listen((change) => {
      if (change === 'opened') {
        this.bounds = null;
        this.exactOffset = null;
        callbacks.showPlane(null);
      }
      if (change !== 'settings' && change !== 'chosen') this.forget();
      if (change === 'opened' || change === 'settings') this.restore();
    });
    this.watchControls();
  }

  watchControls() {
    radios('section').forEach((radio) => radio.addEventListener('change', () => {
      this.exactOffset = null;
      this.update();
      element('section-slider', HTMLElement).scrollIntoView({ block: 'nearest' });
    }));
    radios('section-shown').forEach((radio) => radio.addEventListener('change', () => this.update()));
    input('section-offset').addEventListener('input', () => {
      this.exactOffset = null;
      this.update();
    });
    input('section-position').addEventListener('change', (event) => {
      const { value, valueAsNumber } = /** @type {HTMLInputElement} */ (event.currentTarget);
      if (value !== '' && Number.isFinite(valueAsNumber)) this.moveTo(valueAsNumber);
      this.update();
    });
    NORMAL_FIELDS.forEach((id) => input(id).addEventListener('input', () => {
      this.exactOffset = null;
      this.update();
    }));
    button('section-facing').addEventListener('click', () => {
      const direction = this.callbacks.facing();
      if (direction === null) return;
      NORMAL_FIELDS.forEach((id, axis) => { input(id).value = String(Number(direction[axis].toPrecision(4))); });
      this.exactOffset = null;
      this.update();
    });
    button('section-here').addEventListener('click', () => {
      const [normal, place] = [this.readNormal(), this.callbacks.place()];
      if (normal === null || place === null) announce('Click a point of the surface first');
      else this.moveTo(dot(normal, place));
    });
  }

  /** Shows the plane of the settings, if it comes from an address. */
  restore() {
    const { section, sectionShown } = this.state.settings;
    if (this.noteTimer !== 0 || (section === this.noted.section && sectionShown === this.noted.sectionShown)) return;
    this.noted = { section, sectionShown };
    const plane = readPlane(section);
    const axis = plane?.normal.join(' ') ?? '';
    checkRadio('section', plane === null ? 'off' : { '1 0 0': 'x', '0 1 0': 'y', '0 0 1': 'z' }[axis] ?? 'free');
    checkRadio('section-shown', sectionShown);
    if (plane !== null) NORMAL_FIELDS.forEach((id, k) => { input(id).value = String(plane.normal[k]); });
    this.dragged = null;
    this.exactOffset = plane?.offset ?? null;
    this.update();
  }

  /** Writes the plane into the settings, but not with each step of a slider. @param {string} section */
  note(section) {
    const sectionShown = /** @type {SectionPlane['shown']} */ (getChecked('section-shown'));
    if (section === this.noted.section && sectionShown === this.noted.sectionShown) return;
    this.noted = { section, sectionShown };
    clearTimeout(this.noteTimer);
    this.noteTimer = setTimeout(() => {
      this.noteTimer = 0;
      this.state.set({ section, sectionShown });
    }, NOTE_PAUSE);
  }

  /** Moves the plane by a distance along its normal. @param {number} distance */
  moveBy(distance) {
    const normal = this.readNormal();
    if (normal === null || this.bounds === null) return;
    const range = findRange(normal, this.bounds);
    // Steps that are smaller than the digits that are shown add up.
    const offset = this.dragged ?? this.readOffset(range);
    this.dragged = Math.min(range[1], Math.max(range[0], offset + distance));
    this.exactOffset = roundIn(range, this.dragged);
    this.update();
  }

  /** @param {number} offset */
  moveTo(offset) {
    this.dragged = null;
    this.exactOffset = offset;
    this.update();
  }

  /** The unit normal that is chosen; null if the section is off, or the normal has no direction. */
  readNormal() {
    const choice = getChecked('section');
    if (choice === 'free') return normalize(NORMAL_FIELDS.map((id) => Number(input(id).value)));
    const axis = AXES.indexOf(choice);
    return axis < 0 ? null : AXES.map((_, k) => Number(k === axis));
  }

  /** @param {[number, number]} range */
  readOffset(range) {
    return this.exactOffset ?? offsetAt(range, Number(input('section-offset').value));
  }

  /** Cuts the surface whose mesh is now shown. @param {Report['bounds']} bounds */
  showMesh(bounds) {
    this.bounds = bounds;
    this.update();
  }

  /** Requests the section that the controls describe, unless it was requested. */
  update() {
    const choice = getChecked('section');
    const normal = this.readNormal();
    element('section-slider', HTMLElement).hidden = choice === 'off';
    element('section-normal', HTMLElement).hidden = choice !== 'free';
    if (this.exactOffset === null) this.dragged = null;
    if (normal === null) {
      this.forget();
      this.callbacks.showPlane(null);
      this.note('');
    }
    if (normal === null || this.bounds === null) return;
    const range = findRange(normal, this.bounds);
    const offset = this.readOffset(range);
    const text = describe(normal, offset);
    // Of a free normal, its fields are beside the slider.
    write('section-offset-value', choice === 'free' ? `n · p = ${text.split(' = ')[1]}` : text);
    const slider = input('section-offset');
    if (this.exactOffset !== null) slider.value = String(shareOf(range, offset));
    slider.setAttribute('aria-valuetext', text);
    input('section-position').value = String(offset);
    this.callbacks.showPlane({
      normal, offset, shown: /** @type {SectionPlane['shown']} */ (getChecked('section-shown')),
    });
    const written = choice === 'free' ? NORMAL_FIELDS.map((id) => Number(input(id).value)) : normal;
    this.note([...written, offset].join(','));
    const asked = JSON.stringify([normal, offset]);
    if (asked === this.asked) return;
    this.asked = asked;
    // Not later with each change: the lines follow a plane that moves.
    this.wanted = { normal, offset };
    if (this.timer === 0) this.timer = setTimeout(() => this.cut(), PAUSE);
  }

  /** Requests the section that is wanted now, and shows it if no newer one has come before it. */
  async cut() {
    this.timer = 0;
    try {
      const polylines = await this.requests.run(this.wanted);
      if (polylines) this.show(polylines);
    } catch (error) {
      this.fail(/** @type {Error} */ (error));
    }
  }

  /** Removes the section, and drops its requests. */
  forget() {
    clearTimeout(this.timer);
    this.timer = 0;
    this.requests.abort();
    this.asked = '';
    this.clear();
  }

  /** @param {Polyline[]} polylines */
  show(polylines) {
    this.clear();
    const { length, text } = describeLines(polylines);
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
